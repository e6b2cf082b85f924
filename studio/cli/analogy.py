"""``fba analogy``: the expression of one photograph on another."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from studio.cli.arguments import AsJson
from studio.cli.outcome import usage
from studio.picture_detector import FBA_DETECTOR

if TYPE_CHECKING:
    from cloning.image import AnalogyResult

TURNED = 0.08
"""Beyond this much turning of the source's head a warning is given: the shared pairs looked at reach 0.06 from the
front; one with a head half turned, where cheek and ear come along wrongly, has 0.12."""

RELIT = 0.1
"""Beyond this a warning says that the source's pictures differ in light: renderings in one light have 0.01 to 0.02,
photographs of one sitting 0.05 to 0.07; those with another light or exposure 0.12 and more."""


def analogy(
    source: Annotated[Path, typer.Argument(metavar="S", help="A photograph of somebody's neutral face.")],
    expression: Annotated[
        Path, typer.Argument(metavar="S_EXPR", help="The same person with an expression; or a folder of pictures.")
    ],
    target: Annotated[Path, typer.Argument(metavar="T", help="Somebody else's neutral face.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Where to write: a .png; for a folder S_EXPR a folder.")
    ] = None,
    landmarks: Annotated[
        Path | None, typer.Option(help="Points of all pictures (JSON). Else NAME.points.json beside each.")
    ] = None,
    method: Annotated[
        Literal["vtc", "eri"], typer.Option(help="vtc: vertex tents; eri: expression ratio images, the baseline.")
    ] = "vtc",
    teeth: Annotated[
        bool, typer.Option("--teeth/--no-teeth", help="Show the source's mouth where the lips part.")
    ] = True,
    template: Annotated[
        Path | None, typer.Option(help="Only write points to adjust (JSON), and a picture of them beside it (PNG).")
    ] = None,
    detector: Annotated[
        str | None,
        typer.Option(
            envvar=FBA_DETECTOR, help="Find missing points: the python of an environment with mediapipe 0.10.21."
        ),
    ] = None,
    as_published: Annotated[
        bool, typer.Option("--as-published", help="vtc without the guard that keeps the source's beard or pores away.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Put the expression of one photograph on another: the warp of the points, and wrinkles and shades."""
    inputs = [source, expression, target]
    if template is not None:
        _write_template(inputs, template, landmarks, detector)
        return
    if output is None:
        usage("-o OUT.png says where to write the picture (or --template POINTS.json, to write points first)")
        return
    _check(inputs, landmarks, output)
    rows = []
    for path, result, seconds in _transferred(inputs, output, landmarks, method, teeth, detector, as_published):
        rows.append({
            "file": str(path), "changed_pixels": int(result.changed.sum()), "steps": result.steps,
            "mouth_from_source": result.teeth, "turned": round(result.turned, 4), "relit": round(result.relit, 4),
            "findings": _findings(result), "seconds": round(seconds, 3),
        })  # fmt: skip
    _tell(rows, method, as_json)


def _tell(rows: list[dict[str, object]], method: str, as_json: bool) -> None:
    from studio.cli.console import console, print_json

    if as_json:
        print_json({"method": method, "pictures": rows})
        return
    out = console()
    for row in rows:
        mouth = "; what the lips open shows the source's mouth" if row["mouth_from_source"] else ""
        for finding in cast("list[str]", row["findings"]):
            out.print(f"warning: {row['file']}: {finding}")
        out.print(f"{row['file']}: {row['changed_pixels']} pixels changed in {row['seconds']} s{mouth}")


def _findings(result: AnalogyResult) -> list[str]:
    """What about the pictures spoils the result."""
    found = []
    if result.turned > TURNED:
        found.append("the source's head turned between its pictures, so cheeks and jaw move; choose two from one side")
    if result.relit > RELIT:
        found.append("the source's pictures differ in light or exposure, which shows on the target; choose two alike")
    return found


def _check(inputs: list[Path], landmarks: Path | None, output: Path) -> None:
    from formats.files import require_folder

    folder = inputs[1].is_dir()
    if not folder and output.suffix.lower() != ".png":
        usage(f"{output}: pictures are written as .png, which keeps untouched pixels as they are")
    if folder and (output.suffix or output.is_file()):
        usage(f"{output}: {inputs[1]} is a folder, so the pictures go to a folder as well")
    if output.absolute() in {p.absolute() for p in (*inputs, landmarks) if p is not None}:
        usage(f"{output}: this call reads that already; choose another name")
    require_folder(output)


def _transferred(
    inputs: list[Path],
    output: Path,
    landmarks: Path | None,
    method: Literal["vtc", "eri"],
    teeth: bool,
    python: str | None,
    as_published: bool,
) -> Iterator[tuple[Path, AnalogyResult, float]]:
    """Write one picture after the other."""
    from cloning.image import Analogy
    from studio.photos import known_points, pictures_of, read_photo, with_points, write_photo

    source, expression, target = inputs
    several = expression.is_dir()
    paths = [source, target, *(pictures_of(expression) if several else [expression])]
    pixels = [read_photo(path) for path in paths]
    one, other, *poses = with_points(paths, pixels, known_points(paths, pixels, landmarks, python))
    prepared = Analogy(one, other, [p.points for p in poses], method, teeth, as_published=as_published)
    if several:
        output.mkdir(exist_ok=True)
    for path, pose in zip(paths[2:], poses, strict=True):
        start = time.perf_counter()
        result = prepared.apply(pose)
        written = output / f"{path.stem}.png" if several else output
        write_photo(result.rgb, written)
        yield written, result, time.perf_counter() - start


def _write_template(inputs: list[Path], template: Path, landmarks: Path | None, python: str | None) -> None:
    """Complete the points of all pictures, and draw them."""
    from formats.files import require_folder
    from formats.picture_points import write_picture_points
    from studio.cli.console import console
    from studio.photos import known_points, pictures_of, read_photo, write_photo
    from studio.picture_points import points_picture, template_points

    drawing = template.with_suffix(".png")
    if template.suffix.lower() != ".json" or drawing.absolute() in {p.absolute() for p in inputs}:
        usage(f"--template {template}: write to a .json whose name, with .png, is none of the pictures")
    require_folder(template)
    source, expression, target = inputs
    paths = [source, *(pictures_of(expression) if expression.is_dir() else [expression]), target]
    pixels = [read_photo(path) for path in paths]
    known = known_points(paths, pixels, landmarks, python)
    sizes = {path.name: (p.shape[1], p.shape[0]) for path, p in zip(paths, pixels, strict=True)}
    if len(sizes) < len(paths):
        usage("--template: two pictures have the same name; rename one")
    points = [
        found if python is not None and found else template_points(sizes[path.name], found)
        for path, found in zip(paths, known, strict=True)
    ]
    write_picture_points(template, {p.name: dict(q) for p, q in zip(paths, points, strict=True)}, sizes)
    write_photo(points_picture(pixels, list(points)), drawing)
    console().print(f"{template}: points to adjust, drawn in {drawing}; then: fba analogy ... --landmarks {template}")
