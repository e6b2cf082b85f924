"""``fba demo``: the main job on shipped samples."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for everything that is made.")] = Path(
        "out/demo"
    ),
) -> None:
    """Clone the shipped source onto three plain heads, export, play and draw them, and print measures."""
    from fba.errors import OutputFileError
    from studio.cli.console import console, print_findings, progress, table
    from studio.demo import run_demo

    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFileError(f"cannot make the folder {output}: {error.strerror or error}") from error
    with progress() as tell:
        rows = run_demo(output, tell)
    out = console()
    table(
        "Three plain heads, made animatable",
        ("head", ">vertices", "polygons", ">tables", ">own FP, worst error", ">all FPs, error", ">cloned in"),
        [
            (
                r.head,
                f"{r.vertices:,}",
                r.polygons,
                str(r.tables),
                f"{100 * r.worst_own:.3f} %",
                f"{100 * r.fp_error:.3f} %",
                f"{r.seconds:.1f} s",
            )
            for r in rows
        ],
        out,
    )
    for row in rows:
        shown = [f for f in row.findings if f.severity != "info"]
        if shown:
            out.print(f"\n{row.head}:")
            print_findings(shown, out)
    out.print("\nLook at these:")
    for row in rows:
        out.print("  " + "  ".join(str(path) for path in row.files), soft_wrap=True)
