"""``fba compare``: cloning grids, sources in rows and targets in columns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studio.cli.arguments import AsJson
from studio.cli.outcome import Outcome, usage

if TYPE_CHECKING:
    from studio.comparison import Comparison, Way


COLUMNS = (
    "FP error: difference of the FAP values that the feature points show, relative to the source's. flips: triangles "
    "that turn over, of those that move. stretch: how far edges change in length, the 99th percentile of |log|. Beside "
    "both the source's own."
)
DRIFT = "drift: distance of the skin's motion from the first generation's, relative to it."


def compare(
    sources: Annotated[
        list[str],
        typer.Argument(help="Faces whose motion is cloned: a row each. A plain mesh first gets the shipped source's."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="The grid, a .png.")],
    targets: Annotated[
        list[str] | None,
        typer.Option(help="Faces to clone onto: a column each, as many as follow. Default: the sources themselves."),
    ] = None,
    motion: Annotated[
        str,
        typer.Option(
            help="Motions by commas, a grid each: surprise, viseme_ih, open_jaw=800+37=100; "
            "combination: the one of Pandzic's figure 13."
        ),
    ] = "surprise",
    backends: Annotated[str, typer.Option(help="Backends side by side, by commas, e.g. fit,fmc,vtc; 'all'.")] = "fit",
    as_published: Annotated[
        bool, typer.Option("--as-published", help="Also each backend exactly as its paper has it.")
    ] = False,
    generations: Annotated[
        int, typer.Option(min=1, max=9, help="Clone the clone again: from target to source and back, so many times.")
    ] = 1,
    cell: Annotated[int, typer.Option(min=40, max=1000, help="Width of one picture, pixels.")] = 180,
    as_json: AsJson = False,
) -> None:
    """Clone sources onto targets, and show and measure the same motion on all of them."""
    from fba.errors import InputFileError
    from formats.files import require_folder
    from studio.cli.console import print_findings, print_json, progress
    from studio.compared_faces import read_models
    from studio.comparing import compare as run
    from studio.motions import parse_motions
    from studio.sheet import save_png

    ways = _ways(backends, as_published)
    if output.suffix.lower() != ".png":
        usage(f"{output}: the grid is a .png")
    if output.absolute() in {Path(name).absolute() for name in (*sources, *(targets or ()))}:
        usage(f"{output}: this call reads that file; choose another name")
    require_folder(output)
    picks = parse_motions(motion)
    if len({*sources, *(targets or ())}) == 1:
        usage("a face cannot be compared with itself alone; name a second one, or --targets")
    with progress() as tell:
        tell("reading the faces", 0.0)
        models, left_out = read_models((*sources, *(targets or ())))
        rows = [models[name] for name in dict.fromkeys(sources) if name in models]
        columns = [models[name] for name in dict.fromkeys(targets or sources) if name in models]
        if all(row.path == column.path for row in rows for column in columns):
            raise InputFileError("; ".join(f"{f.where}: {f.message}" for f in left_out))
        result = run(rows, columns, picks, ways, generations=generations, cell=cell, progress=tell)
        result = replace(result, findings=(*left_out, *result.findings))
        save_png(result.image(), output)
    if as_json:
        from studio.cli.console import findings_json

        print_json({**result.to_dict(), "findings": findings_json(result.findings), "picture": str(output)})
    else:
        from studio.cli.console import console

        out = console()
        print_findings(result.findings, out)
        _print(result)
        counted = ((rows, "source"), (columns, "target"), (picks, "motion"))
        said = ", ".join(f"{len(some)} {word}{'s' if len(some) != 1 else ''}" for some, word in counted)
        out.print(f"{output}: {said}")
    if any(f.severity == "error" for f in result.findings):
        raise typer.Exit(Outcome.FINDINGS)


def _ways(text: str, as_published: bool) -> list[Way]:
    from cloning import backends
    from studio.comparison import Way

    known = [b.name for b in backends()]
    names = known if text == "all" else list(dict.fromkeys(n for n in (p.strip() for p in text.split(",")) if n))
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        what = f"there is no backend '{unknown[0]}'" if unknown else "no backend is named"
        usage(f"--backends: {what}; choose from: {', '.join(known)}")
    modes = (False, True) if as_published else (False,)
    return [Way(name, published) for name in names for published in modes]


def _print(result: Comparison) -> None:
    from studio.cli.console import console, table

    head = (">FP error", ">flips", ">source's", ">stretch", ">source's", ">drift")
    rows = [
        (c.source, c.target, _way(c.backend, c.as_published), str(c.generation), c.motion, *_numbers(c))
        for c in result.cells
    ]
    table("", ("source", "target", "backend", ">generation", "motion", *head), rows, console())
    drifts = any(c.drift is not None for c in result.cells)
    console().print(COLUMNS + (" " + DRIFT if drifts else ""))
    means = [(_way(m.backend, m.as_published), str(m.generation), str(m.cells), *_numbers(m)) for m in result.means()]
    console().print("Mean of all cells:")
    table("", ("backend", ">generation", ">cells", *head), means, console())


def _way(backend: str, published: bool) -> str:
    return f"{backend} published" if published else backend


def _numbers(row: object) -> tuple[str, ...]:
    values = {name: getattr(row, name) for name in ("fp_error", "flips", "source_flips", "stretch", "source_stretch")}
    drift = getattr(row, "drift", None)
    return (
        f"{100 * values['fp_error']:.2f} %",
        f"{values['flips']:.2f} %",
        f"{values['source_flips']:.2f} %",
        f"{values['stretch']:.3f}",
        f"{values['source_stretch']:.3f}",
        "" if drift is None else f"{drift:.3f}",
    )
