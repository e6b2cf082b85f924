"""``fba author``: make a source from modelled shapes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from studio.cli.outcome import usage
from studio.cli.outputs import check_outputs

if TYPE_CHECKING:
    from authoring.report import AuthorReport
    from fat.face import AnimatableFace
    from fba.feature_points import FeaturePoints
    from fba.scene import FaceScene
    from fba.shapes import ShapeSet

NeutralPath = Annotated[Path, typer.Argument(help="The neutral face; a glTF or USD may hold the shapes as well.")]
Out = Annotated[Path, typer.Option("--output", "-o", help="Where to write; the extension chooses the format.")]

WITH_SHAPES = (".glb", ".gltf", ".usda", ".usdc", ".usd", ".usdz")


def author(
    neutral: NeutralPath,
    output: Out,
    shapes: Annotated[
        Path | None, typer.Option(help="Modelled shapes: a folder of OBJ, an .npz, a glTF or a USD; default: NEUTRAL.")
    ] = None,
    landmarks: Annotated[
        Path | None, typer.Option(help="Feature points of the face; default: NAME.fps.json beside it.")
    ] = None,
    names: Annotated[
        Path | None, typer.Option("--map", help="A TOML file that says what shapes of other names mean.")
    ] = None,
    open_jaw: Annotated[
        Literal["practical", "strict"],
        typer.Option(help="FAP 3 opens the mouth (practical), or leaves the lips as the standard has it (strict)."),
    ] = "practical",
    construct: Annotated[
        bool, typer.Option("--construct/--no-construct", help="Construct the FAPs that no shape shows.")
    ] = True,
    report: Annotated[Path | None, typer.Option(help="Write what everything was made from as JSON.")] = None,
    sheet: Annotated[Path | None, typer.Option(help="Write a contact sheet (PNG) of the new source.")] = None,
) -> None:
    """Make an animatable source from a face's own modelled shapes; what they do not show is constructed."""
    from authoring.author import author as make
    from authoring.shape_map import parse_map
    from formats import format_of, write
    from formats.files import read_bytes, write_bytes
    from studio.cli.console import console, print_findings, progress
    from studio.inputs import left_behind

    check_outputs(output, report, sheet, inputs=(neutral, shapes, landmarks, names))
    entry = format_of(output, writing=True)
    if not entry.carries_tables:
        usage(f"{output}: {entry.name} cannot carry Facial Animation Tables; choose .wrl, .bt, .usda or .usdc")
    if shapes is None and neutral.suffix.lower() not in WITH_SHAPES:
        usage(f"{neutral} holds no shapes: give them with --shapes (a folder of OBJ, an .npz, a glTF or a USD)")
    meanings = None if names is None else parse_map(read_bytes(names), str(names))
    with progress() as tell:
        tell("reading", 0.0)
        scene, points, given = _read(neutral, shapes, landmarks)
        face, made = make(scene, points, given, map=meanings, open_jaw=open_jaw, construct=construct, progress=tell)
        tell("writing", 0.95)
        write(face, output)
        if sheet is not None:
            tell("drawing", 0.97)
            _draw(face, sheet)
        if report is not None:
            write_bytes(report, (made.to_json() + "\n").encode())
    print_findings((*made.findings, *left_behind(scene, neutral, output)), console())
    _summary(made, face, output)


def _read(
    neutral: Path, shapes: Path | None, landmarks: Path | None
) -> tuple[FaceScene, FeaturePoints | None, ShapeSet]:
    from fat.face import AnimatableFace
    from fat.rig import unrig
    from formats import read
    from formats.shapes import read_shapes
    from studio.inputs import points_of

    found = read(neutral)
    scene = unrig(found) if isinstance(found, AnimatableFace) else found
    return scene, points_of(found, neutral, landmarks), read_shapes(shapes or neutral, scene)


def _draw(face: AnimatableFace, path: Path) -> None:
    from studio.sheet import face_sheet, save_png

    save_png(face_sheet(face, title=face.scene.name), path)


def _summary(made: AuthorReport, face: AnimatableFace, output: Path) -> None:
    """How many tables come from where, and which could not be made."""
    from studio.cli.console import console

    out = console()
    words = (
        ("given", "given by shapes"),
        ("units", "made of units"),
        ("posed", "posed"),
        ("constructed", "constructed"),
        ("rigged", "turned by transforms"),
    )
    for how, text in words:
        entries = made.made(how)  # type: ignore[arg-type]
        if entries:
            out.print(f"{text}: {', '.join(e.name for e in entries)}", soft_wrap=True)
    for entry in made.missing:
        out.print(f"missing: {entry.name}: {entry.why}", soft_wrap=True)
    jaw = f", open_jaw {made.open_jaw}" if made.open_jaw else ""
    out.print(f"{output}: {len(face.tables)} tables for {face.scene.vertex_count} vertices{jaw}")
