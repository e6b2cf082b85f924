"""``fba check``: is an animatable face good?"""

from __future__ import annotations

from typing import Annotated

import typer

from studio.cli.arguments import AsJson, FacePath
from studio.cli.outcome import Outcome


def check(
    face: FacePath,
    source: Annotated[
        str | None, typer.Option(help="The face it was cloned from ('default'): compare every motion.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check conformance and quality; ends with 1 when something fails."""
    from formats import read_face
    from studio.checking import check_face, check_file
    from studio.cli.console import console, print_findings, print_json, table

    result = check_face(read_face(str(face)), None if source is None else read_face(source), check_file(face))
    if as_json:
        print_json({"file": str(face), **result.to_dict()})
    else:
        out = console()
        rows = [
            (str(f.fap_id), f.name, f.point, str(f.value), f"{f.found:.1f}", f"{100 * f.relative_error:.2f} %")
            for f in result.faps
        ]
        if rows:
            table("", (">FAP", "name", "point", ">value", ">moves", ">error"), rows, out)
        if result.fidelity is not None:
            for name, value in result.to_dict()["fidelity"].items():  # type: ignore[attr-defined]
                out.print(f"{name}: {value:.4g}" if isinstance(value, float) else f"{name}: {value}")
        if result.unmeasured:
            out.print("not measured, for lack of a feature point on a surface: " + ", ".join(result.unmeasured))
        print_findings((*result.problems, *result.findings), out)
        out.print("passed" if result.passed else "FAILED")
    if not result.passed:
        raise typer.Exit(Outcome.FINDINGS)
