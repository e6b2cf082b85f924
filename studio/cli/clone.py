"""``fba clone``: make a plain mesh animatable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studio.cli.arguments import OpenJaw
from studio.cli.outcome import usage
from studio.cli.outputs import check_outputs

if TYPE_CHECKING:
    from cloning import CloneReport
    from fat.face import AnimatableFace
    from fat.open_jaw import Mode

TargetPath = Annotated[Path, typer.Argument(help="The plain face mesh that shall become animatable.")]
Out = Annotated[Path, typer.Option("--output", "-o", help="Where to write; the extension chooses the format.")]
Landmarks = Annotated[
    Path | None, typer.Option(help="Feature points of the target; default: NAME.fps.json beside it, or detected.")
]
Shapes = Annotated[
    Path | None,
    typer.Option(help="Clone these morph targets of --source instead: a folder of OBJ, an .npz or a glTF."),
]


def clone(
    target: TargetPath,
    output: Out,
    source: Annotated[str, typer.Option(help="The animatable face whose motion is cloned.")] = "default",
    landmarks: Landmarks = None,
    source_landmarks: Annotated[
        Path | None, typer.Option(help="Feature points of --source where it has none of its own.")
    ] = None,
    backend: Annotated[str, typer.Option(help="How motion is cloned: fit, dt, vtc, vtc-image, fmc or ec.")] = "fit",
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Do literally what the paper says, for comparison; vtc and vtc-image then give the target's shape in "
            "the source's topology.",
        ),
    ] = False,
    faps: Annotated[str | None, typer.Option(help="Only these FAPs, e.g. 3,5,12-14 or open_jaw.")] = None,
    open_jaw: OpenJaw = None,
    shapes: Shapes = None,
    report: Annotated[Path | None, typer.Option(help="Write measures, warnings and timings as JSON.")] = None,
    sheet: Annotated[Path | None, typer.Option(help="Write a contact sheet (PNG): source above target.")] = None,
    chessboard: Annotated[
        Path | None,
        typer.Option("--map", help="Write a picture of the correspondence (PNG): a chessboard on both faces."),
    ] = None,
) -> None:
    """Clone the motion of an animatable face onto a plain mesh and write an animatable face."""
    from cloning import backends
    from studio.cli.arguments import parse_faps

    known = [b.name for b in backends()]
    if backend not in known:
        usage(f"--backend: there is no backend '{backend}'; choose one of: {', '.join(known)}")
    try:
        wanted = None if faps is None else parse_faps(faps)
    except ValueError as error:
        usage(f"--faps: {error}")
    check_outputs(output, report, sheet, inputs=(target, landmarks, source_landmarks, shapes), chessboard=chessboard)
    if shapes is not None:
        if wanted is not None or sheet is not None or open_jaw is not None or chessboard is not None:
            usage("--shapes clones every shape as it is; it does not go with --faps, --open-jaw, --sheet or --map")
        _clone_shapes(target, output, source, landmarks, source_landmarks, shapes, backend, as_published, report)
    else:
        _clone_face(
            target,
            output,
            source,
            landmarks,
            source_landmarks,
            wanted,
            backend,
            as_published,
            open_jaw,
            report,
            sheet,
            chessboard,
        )


def _clone_face(
    target: Path,
    output: Path,
    source: str,
    landmarks: Path | None,
    source_landmarks: Path | None,
    faps: tuple[int, ...] | None,
    backend: str,
    as_published: bool,
    open_jaw: Mode | None,
    report: Path | None,
    sheet: Path | None,
    chessboard: Path | None,
) -> None:
    from dataclasses import replace

    from cloning import clone_with_report
    from formats import format_of, read, read_face, write
    from formats.landmarks import read_landmarks
    from studio.cli.console import console, print_findings, progress
    from studio.inputs import left_behind, points_of, scene_of
    from studio.jaw_mode import with_open_jaw
    from studio.sheet import contact_sheet, save_png

    entry = format_of(output, writing=True)
    if not entry.carries_tables:
        usage(f"{output}: {entry.name} cannot carry Facial Animation Tables; choose .wrl, .bt, .usda or .usdc")
    animatable = read_face(source)
    if source_landmarks is not None:
        points = read_landmarks(source_landmarks, animatable.scene)
        animatable = replace(animatable, feature_points=points)
    with progress() as tell:
        tell("reading", 0.0)
        found = read(target)
        points_given = points_of(found, target, landmarks)
        face, made = clone_with_report(
            animatable, found, points_given, backend=backend, as_published=as_published, faps=faps, progress=tell
        )
        face, said = with_open_jaw(face, open_jaw)
        tell("writing", 0.95)
        write(face, output)
        if sheet is not None:
            tell("drawing", 0.97)
            save_png(contact_sheet(animatable, face, title=face.scene.name), sheet)
        if chessboard is not None:
            _draw_map(animatable, face, backend, as_published, chessboard)
        if report is not None:
            _write_report(made, report)
    out = console()
    print_findings((*made.findings, *said, *left_behind(scene_of(found), target, output)), out)
    out.print(f"{output}: {len(face.tables)} tables for {face.scene.vertex_count} vertices")


def _draw_map(source: AnimatableFace, target: AnimatableFace, backend: str, as_published: bool, path: Path) -> None:
    from cloning.mapping import map_skin
    from studio.chessboard import chessboard
    from studio.sheet import save_png

    save_png(chessboard(*map_skin(source, target, backend=backend, as_published=as_published)), path)


def _clone_shapes(
    target: Path,
    output: Path,
    source: str,
    landmarks: Path | None,
    source_landmarks: Path | None,
    shapes: Path,
    backend: str,
    as_published: bool,
    report: Path | None,
) -> None:
    from cloning import clone_shapes
    from fba.errors import LandmarkError
    from formats import read
    from formats.shapes import read_shapes, write_shapes
    from formats.usd import write_shape_set
    from studio.cli.console import console, print_findings, progress
    from studio.inputs import points_of, scene_of

    stage = output.suffix.lower() in (".usd", ".usda", ".usdc")
    if not stage and output.suffix.lower() not in (".npz", "") and not output.is_dir():
        usage(f"{output}: shapes are written to .npz, .usda, .usdc, or a folder of OBJ (no extension)")
    neutral = read(source)
    neutral_scene = scene_of(neutral)
    neutral_points = points_of(neutral, Path(source), source_landmarks)
    if neutral_points is None:
        raise LandmarkError(f"{source} has no feature points; give them with --source-landmarks POINTS.json")
    found = read(target)
    scene = scene_of(found)
    with progress() as tell:
        made, about = clone_shapes(
            neutral_scene,
            neutral_points,
            read_shapes(shapes, neutral_scene),
            scene,
            points_of(found, target, landmarks),
            backend=backend,
            as_published=as_published,
            progress=tell,
        )
        if stage:
            write_shape_set(scene, made, output)
        else:
            write_shapes(made, scene, output)
        if report is not None:
            _write_report(about, report)
    out = console()
    print_findings(about.findings, out)
    out.print(f"{output}: {len(made.names)} shapes for {len(made.neutral)} vertices")


def _write_report(made: CloneReport, path: Path) -> None:
    from formats.files import write_bytes

    write_bytes(path, (made.to_json() + "\n").encode())
