"""``fba inspect``: what a file holds, what it can play, what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from studio.cli.arguments import AsJson
from studio.cli.outcome import Outcome


def inspect(
    file: Annotated[Path, typer.Argument(help="A face or a stream; 'default' names the shipped source.")],
    landmarks: Annotated[
        Path | None, typer.Option(help="Feature points; default: NAME.fps.json beside the file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say what a file holds, what it can play, and what is wrong with it."""
    from formats.streams import STREAM_FORMATS
    from studio.cli.console import console, findings_json, print_findings, print_json

    if any(file.suffix.lower() in kind.extensions for kind in STREAM_FORMATS if not kind.in_faces):
        about, findings = _stream(file)
    else:
        about, findings = _face(file, landmarks)
    if as_json:
        print_json({**about, "findings": findings_json(findings)})
    else:
        out = console()
        _print(about, out)
        print_findings(findings, out)
    if any(f.severity == "error" for f in findings):
        raise typer.Exit(Outcome.FINDINGS)


def _stream(file: Path) -> tuple[dict[str, Any], list[Any]]:
    from formats.streams import read_stream
    from studio.describe import describe_stream

    stream, findings = read_stream(file)
    return {"file": str(file), "kind": "FAP stream", **describe_stream(stream)}, findings


def _face(file: Path, landmarks: Path | None) -> tuple[dict[str, Any], list[Any]]:
    from fat.face import AnimatableFace
    from fba.findings import Finding
    from formats import read
    from formats.textures import missing_textures
    from studio.describe import describe_face, describe_points, describe_scene, mesh_findings
    from studio.inputs import scene_of, target_points

    found = read(file)
    textures = [
        Finding("warning", "no-texture", f"the texture file {name} is not there")
        for name in missing_textures(scene_of(found))
    ]
    if isinstance(found, AnimatableFace):
        about, findings = describe_face(found)
        kind = "animatable face"
        scene = found.scene
    else:
        scene, points, findings = target_points(found, file, landmarks)
        about, kind = describe_scene(scene), "plain mesh (dumb face)"
        if points is not None:
            more, neutral = describe_points(scene, points)
            about, findings = {**about, **more}, [*findings, *neutral]
    return {"file": str(file), "kind": kind, **about}, [*mesh_findings(scene), *textures, *findings]


def _print(about: dict[str, Any], out: Any) -> None:
    from fat.open_jaw import MEANINGS, NOTE
    from studio.cli.console import table
    from studio.describe import number_ranges

    out.print(f"{about['file']}: {about['kind']}")
    if about["kind"] == "FAP stream":
        out.print(f"{about['frames']} frames at {about['frame_rate']:g}/s, {about['seconds']:.1f} s")
        table("", ("FAP", ">lowest", ">highest"), [(k, str(a), str(b)) for k, (a, b) in about["ranges"].items()], out)
        return
    rows = [
        (
            s["name"],
            s["role"],
            str(s["vertices"]),
            f"{s['polygons']} ({s['triangles']} tri, {s['quads']} quad, {s['larger']} larger)",
            str(s["components"]),
            str(s["border_edges"]),
            ", ".join(s["textures"]) or ("uv" if s["uv"] else "-"),
        )
        for s in about["shapes"]
    ]
    table("", ("shape", "role", ">vertices", "polygons", ">parts", ">border edges", "texture"), rows, out)
    if about["morph_targets"]:
        names = about["morph_targets"]
        out.print(f"{len(names)} morph targets: {', '.join(names[:6])}{', ...' if len(names) > 6 else ''}")
    if about.get("fapu"):
        out.print("FAPUs: " + ", ".join(f"{k} {v:.4g}" for k, v in about["fapu"].items()))
    if "feature_points" in about:
        out.print(f"feature points: {about['feature_points']} of 84")
    if "tables" in about:
        tables = about["tables"]
        out.print(
            f"plays: FAPs {number_ranges(tables['faps'])}; {len(tables['visemes'])} visemes; "
            f"{len(tables['expressions'])} expressions"
        )
        if tables["missing_faps"]:
            out.print(f"cannot play: FAPs {number_ranges(tables['missing_faps'])}")
        mode = about["open_jaw"]
        if mode is not None:
            out.print(f"{NOTE}: {mode}: {MEANINGS[mode]}")
        for key, value in about["notes"].items():
            if key != NOTE or mode is None:
                out.print(f"{key}: {value}")
