"""``fba check``: is an animatable face good?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studio.cli.arguments import AsJson, FacePath
from studio.cli.golden import check_golden
from studio.cli.outcome import Outcome, usage

if TYPE_CHECKING:
    from fat.face import AnimatableFace
    from fat.fap_quality import FapQuality
    from studio.checking import CheckResult
    from studio.verdicts import Verdict

COLUMNS = (
    ">FAP",
    "name",
    ">value",
    ">own error",
    ">cross-talk",
    ">on FAP",
    ">flips",
    ">limit",
    ">flips there",
    ">stretch",
    ">seams",
    ">lining",
    ">in eyes",
    ">mirror",
    "",
)

ROWS_LEGEND = (
    "own error: of the FAP's own feature point; cross-talk: how far another FAP's point moves, in % of the own, and "
    "which FAP's; flips: % of moving triangles that turn over; limit: where the table ends, and flips there; "
    "stretch: of hidden skin, times; seams: vertices that come apart; lining: vertices of hidden skin that come "
    "before the skin; in eyes: % of skin before the eyeballs; mirror: difference of the sides"
)
MEASURE_COLUMNS = ("measure", ">worst", ">source's", ">fails above", "unit", "", "verdict", "where")
MEASURES_LEGEND = (
    "eye sep.: distance of the pupils, 63 mm in an adult; MNS: mouth to nose; IRISD: iris; measures without a unit "
    "are told beside the source's. Each is explained in docs/checking.md"
)


def check(
    face: FacePath,
    source: Annotated[
        str | None, typer.Option(help="The face it was cloned from ('default'): compare every motion.")
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(help="The same mesh with the motion that it should have, as an animatable face: how far is it?"),
    ] = None,
    worst: Annotated[bool, typer.Option(help="Show the worst motions first.")] = False,
    sheet: Annotated[
        Path | None, typer.Option(help="Also draw every FAP, viseme and expression into this .png.")
    ] = None,
    worst_picture: Annotated[
        Path | None,
        typer.Option(help="Also draw the worst place of each measure that is not good into this .png."),
    ] = None,
    stream: Annotated[
        Path | None, typer.Option(help="Instead, with --golden: a stream that another player has played.")
    ] = None,
    golden: Annotated[
        Path | None, typer.Option(help="With --stream: the other player's frames (.npz), to be compared with ours.")
    ] = None,
    rules: Annotated[
        str, typer.Option(help="With --golden: combine FAPs that fight by these rules; the standard has none.")
    ] = "none",
    as_json: AsJson = False,
) -> None:
    """Check conformance and quality of every FAP, viseme and expression; ends with 1 when something fails."""
    if stream is not None or golden is not None:
        if any(given is not None for given in (source, truth, sheet, worst_picture)):
            others = "--source, --truth, --sheet or --worst-picture"
            usage(f"--golden compares the frames of a player; it does not go with {others}")
        check_golden(face, stream, golden, rules, as_json)
        return
    from formats import read_face
    from studio.checking import check_face, check_file
    from studio.cli.console import print_json

    for name, path in (("--sheet", sheet), ("--worst-picture", worst_picture)):
        if path is not None:
            _check_picture(name, path)
    animatable = read_face(str(face))
    beside = None if source is None else read_face(source)
    real = None if truth is None else read_face(truth)
    result = check_face(animatable, beside, check_file(face), real)
    plays = not any(f.severity == "error" for f in result.findings)
    if sheet is not None and plays:
        _draw(animatable, sheet)
    if worst_picture is not None and plays:
        _draw_worst(animatable, beside, result, worst_picture)
    if as_json:
        print_json({"file": str(face), **result.to_dict()})
    else:
        _print(result, worst)
    if not result.passed:
        raise typer.Exit(Outcome.FINDINGS)


def _check_picture(name: str, path: Path) -> None:
    from formats.files import require_folder

    if path.suffix.lower() != ".png":
        usage(f"{name} {path}: the picture is a .png")
    require_folder(path)


def _draw(face: AnimatableFace, path: Path) -> None:
    from studio.cli.console import progress
    from studio.fap_sheet import fap_sheets, tall_sheet
    from studio.sheet import save_png

    with progress() as tell:
        save_png(tall_sheet(fap_sheets(face, progress=tell)), path)


def _draw_worst(face: AnimatableFace, source: AnimatableFace | None, result: CheckResult, path: Path) -> None:
    from studio.cli.console import progress
    from studio.sheet import save_png
    from studio.worst_places import worst_places

    with progress() as tell:
        tell("drawing the worst places", 0.0)
        save_png(worst_places(face, result.verdicts, source), path)


def _print(result: CheckResult, worst: bool) -> None:
    from studio.cli.console import console, print_findings, table
    from studio.grouping import grouped

    out = console()
    rows = sorted(result.compared, key=lambda r: -r[0].severity) if worst else result.compared
    if rows:
        table("", COLUMNS, [_cells(row, beside) for row, beside in rows], out)
        out.print(ROWS_LEGEND)
        if result.source_quality is not None:
            out.print("in brackets: the source's, where it differs")
    if result.verdicts:
        table("", MEASURE_COLUMNS, [_measure_cells(v) for v in result.verdicts], out)
        out.print(MEASURES_LEGEND)
        if result.source_quality is None:
            out.print("without --source: a clone is judged wholly, and fairly, only beside the face it was cloned from")
    if result.unmeasured:
        out.print("not measured, for lack of a feature point on a surface: " + ", ".join(result.unmeasured))
    told = [f for part in (result.problems, result.remarks) for f in grouped(part, result.quality, result.faps)]
    print_findings((*told, *result.findings), out)
    if any(f.severity == "warning" for f in told) and result.source_quality is not None:
        out.print("warnings about motions tell what is worse than on the source; --json has them all")
    out.print(_last_line(result))


def _last_line(result: CheckResult) -> str:
    """Whether the face passes, and what to look at even so."""
    if not result.passed:
        errors = [f.code for f in (*result.problems, *result.findings) if f.severity == "error"]
        kinds = len(set(errors))
        of = f", of {kinds} kinds" if 1 < kinds < len(errors) else ""
        return f"FAILED: {len(errors)} error{'s' * (len(errors) != 1)}{of}"
    others = [v.measure.title for v in result.verdicts if v.failed]
    return "passed" + (f"; no must, but worth a look: {', '.join(others)}" if others else "")


def _measure_cells(verdict: Verdict) -> tuple[str, ...]:
    """One line of the table of measures."""
    measure = verdict.measure
    unit = "" if measure.unit == "times" else measure.unit
    numbers = [
        "-" if v is None else "0" if abs(v) < 1e-9 else f"{v:.3g}"
        for v in (verdict.value, verdict.source, verdict.limit)
    ]
    point = "" if verdict.place.point is None else f"point {verdict.place.point}"
    where = ", ".join(t for t in (verdict.where, point) if t)
    return measure.title, *numbers, unit, "must" if measure.must else "", verdict.word, where


def _cells(row: FapQuality, beside: FapQuality | None) -> tuple[str, ...]:
    """One line of the table; the source's values in brackets."""

    def cell(name: str, form: str, factor: float = 1.0) -> str:
        mine, yours = (None if r is None else getattr(r, name) for r in (row, beside))
        texts = ["-" if v is None else format(factor * v, form) for v in (mine, yours)]
        return texts[0] if beside is None or texts[0] == texts[1] else f"{texts[0]} ({texts[1]})"

    return (
        str(row.fap_id),
        row.name,
        f"{row.value:+d}",
        "-" if row.own is None else f"{100 * row.own.relative_error:.2f} %",
        cell("cross_talk", ".1f", 100.0) + (" %" if row.cross_talk is not None else ""),
        "" if row.cross_fap is None or not row.cross_talk else str(row.cross_fap),
        cell("flips", ".2f"),
        f"{row.limit:+d}",
        cell("flips_at_limit", ".2f"),
        cell("stretch", ".2f"),
        "-" if row.parted is None else str(row.parted),
        "-" if row.through is None else str(row.through),
        cell("penetration", ".2f"),
        cell("asymmetry", ".1f", 100.0) + (" %" if row.asymmetry is not None else ""),
        "" if row.passed else "FAIL",
    )
