"""``fba export``: write a face in another format."""

from __future__ import annotations

from typing import Annotated

import typer

from studio.cli.arguments import FacePath, OutPath
from studio.cli.outcome import usage


def export(
    face: FacePath,
    output: OutPath,
    profile: Annotated[
        str, typer.Option(help="native: everything the tables say, in the format's own terms.")
    ] = "native",
) -> None:
    """Write a face in another format; its tables go along where the format can carry them."""
    from fat.face import AnimatableFace
    from fat.validate import validate
    from fba.errors import FaceDefTablesError
    from formats import format_of, read, write
    from studio.cli.console import console, print_findings
    from studio.inputs import left_behind, scene_of

    if profile != "native":
        usage(f"--profile: there is no profile '{profile}'; known: native")
    entry = format_of(output, writing=True)
    found = read(str(face))
    if isinstance(found, AnimatableFace):
        broken = [f for f in validate(found) if f.severity == "error"]
        if broken:
            raise FaceDefTablesError(f"{face} cannot be played, so it is not exported: {broken[0].message}")
    write(found, output)
    out = console()
    print_findings(left_behind(scene_of(found), face, output), out)
    if isinstance(found, AnimatableFace) and not entry.carries_tables:
        out.print(f"{output}: neutral mesh only, since {entry.name} cannot carry Facial Animation Tables")
    elif isinstance(found, AnimatableFace):
        out.print(f"{output}: {len(found.tables)} tables for {found.scene.vertex_count} vertices")
    else:
        out.print(f"{output}: plain mesh, {found.vertex_count} vertices")
