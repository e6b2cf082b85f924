"""``fba export``: write a face in another format, or the shapes of a profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studio.cli.arguments import FacePath, OpenJaw, OutPath
from studio.cli.outcome import usage

if TYPE_CHECKING:
    from fat.face import AnimatableFace
    from fat.open_jaw import Mode
    from fat.profiles import Profile
    from fba.findings import Finding


def export(
    face: FacePath,
    output: OutPath,
    profile: Annotated[
        str,
        typer.Option(
            help="native: everything the tables say, in the format's own terms; portable: for programs that know "
            "no MPEG-4 nodes (VRML, X3D, USD); arkit, oculus, vrm: the shapes of that name, to .npz, .usda, .usdc, "
            ".glb, .gltf or a folder of OBJ."
        ),
    ] = "native",
    open_jaw: OpenJaw = None,
    stream: Annotated[
        Path | None,
        typer.Option(help="A stream of any kind that becomes the animation of OUT; 'demo' names the shipped one."),
    ] = None,
) -> None:
    """Write a face in another format; its tables go along where the format can carry them."""
    from fat.profiles import PROFILES

    if profile in ("native", "portable"):
        _export_face(face, output, open_jaw, stream, portable=profile == "portable")
        return
    if stream is not None:
        usage(f"--stream goes with the native and portable profiles; the shapes of '{profile}' stay still")
    if open_jaw is not None:
        usage(
            f"--open-jaw goes with the native and portable profiles; the shapes of '{profile}' open the mouth in "
            "their own way"
        )
    chosen = next((p for p in PROFILES if p == profile), None)
    if chosen is None:
        usage(f"--profile: there is no profile '{profile}'; known: native, portable, {', '.join(PROFILES)}")
    else:
        _export_profile(face, output, chosen)


def _export_face(face: Path, output: Path, open_jaw: Mode | None, stream: Path | None, *, portable: bool) -> None:
    from fat.face import AnimatableFace
    from fat.open_jaw import open_jaw_mode
    from formats import format_of, read, write
    from studio.cli.console import console, print_findings
    from studio.inputs import left_behind, scene_of
    from studio.jaw_mode import with_open_jaw
    from studio.streams import open_stream

    entry = format_of(output, writing=True)
    found = read(str(face))
    said: list[Finding] = []
    if isinstance(found, AnimatableFace):
        _refuse_broken(found, face)
        found, said = with_open_jaw(found, open_jaw)
    elif open_jaw is not None:
        usage(f"--open-jaw: {face} is a plain mesh without open_jaw")
    frames = None
    if stream is not None:
        strict = isinstance(found, AnimatableFace) and open_jaw_mode(found) == "strict"
        frames, remarks = open_stream(stream, strict_jaw=strict)
        said = [*said, *remarks]
    write(found, output, frames, portable=portable)
    out = console()
    print_findings([*said, *left_behind(scene_of(found), face, output)], out)
    if isinstance(found, AnimatableFace) and not entry.carries_tables:
        out.print(f"{output}: neutral mesh only, since {entry.name} cannot carry Facial Animation Tables")
    elif isinstance(found, AnimatableFace):
        played = "" if frames is None else f", {len(frames)} frames at {frames.frame_rate:g}/s"
        out.print(f"{output}: {len(found.tables)} tables for {found.scene.vertex_count} vertices{played}")
    else:
        out.print(f"{output}: plain mesh, {found.vertex_count} vertices")


def _export_profile(face: Path, output: Path, profile: Profile) -> None:
    from fat.profiles import profile_shapes
    from formats import gltf, read_face, usd
    from formats.files import require_folder
    from formats.shapes import write_shapes
    from formats.textures import place_textures
    from studio.cli.console import console, print_findings
    from studio.inputs import left_behind

    kind = output.suffix.lower()
    scenes = {".usd": usd, ".usda": usd, ".usdc": usd, ".usdz": usd, ".glb": gltf, ".gltf": gltf}
    if kind not in (*scenes, ".npz", "") and not output.is_dir():
        usage(
            f"{output}: shapes are written to .npz, .usda, .usdc, .usdz, .glb, .gltf, or a folder of OBJ (no extension)"
        )
    require_folder(output)
    found = read_face(str(face))
    _refuse_broken(found, face)
    shut, said = _shut(found) if profile == "arkit" else (None, [])
    shapes, findings = profile_shapes(found, profile, shut)
    beside = scenes.get(kind) is not gltf and kind not in (".npz", ".usdz")
    placed = place_textures(found.scene, output if kind not in scenes else output.parent) if beside else None
    scene = found.scene if placed is None else placed.scene
    if kind in scenes:
        scenes[kind].write_shape_set(scene, shapes, output)
    else:
        write_shapes(shapes, scene, output)
    if placed is not None:
        placed.write()
    out = console()
    print_findings([*findings, *said, *left_behind(found.scene, face, output)], out)
    out.print(f"{output}: {len(shapes.names)} shapes of the profile '{profile}' for {len(shapes.neutral)} vertices")


def _shut(face: AnimatableFace) -> tuple[AnimatableFace | None, list[Finding]]:
    """The face with a jaw that leaves the lips; None where its own does already, or where it cannot be made."""
    from authoring.open_jaw import strict
    from fat.open_jaw import open_jaw_mode
    from fba.errors import FbaError
    from fba.findings import Finding

    if open_jaw_mode(face) != "practical":
        return None, []
    try:
        return strict(face), []
    except FbaError as error:
        text = f"mouthClose is made of lip FAPs, which tear the lips that it should shut: {error}"
        return None, [Finding("warning", "profile-mouth-close", text, "mouthClose")]


def _refuse_broken(face: AnimatableFace, path: Path) -> None:
    from fat.validate import validate
    from fba.errors import FaceDefTablesError

    broken = [f for f in validate(face) if f.severity == "error"]
    if broken:
        raise FaceDefTablesError(f"{path} cannot be played, so it is not exported: {broken[0].message}")
