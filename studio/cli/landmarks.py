"""``fba landmarks``: find a face's feature points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fba.errors import LandmarkError
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.scene import FaceScene
from studio.cli.arguments import AsJson
from studio.cli.outcome import usage
from studio.cli.outputs import check_outputs


def landmarks(
    face: Annotated[Path, typer.Argument(help="A file with a head in it: a scan, a bust, a mask, a whole body.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Where to write the feature points (JSON).")],
    given: Annotated[
        Path | None, typer.Option("--landmarks", help="Points that are right already; a few improve all the others.")
    ] = None,
    detector: Annotated[
        str,
        typer.Option(
            help="auto, or xiang: the 20 landmarks of Xiang et al. (2008) as published; xiang-once: first half."
        ),
    ] = "auto",
    source: Annotated[str, typer.Option(help="The face whose feature points are known.")] = "default",
    sheet: Annotated[
        Path | None, typer.Option(help="Write a picture (PNG) with the points, red = unsure, blue = given.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the feature points of a face: any axes, any unit, anywhere in the file."""
    from cloning.detect import DETECTORS, detect_points
    from cloning.prepare import prepare
    from fba.orientation import orient
    from formats import read, read_face
    from formats.landmarks import read_landmarks, write_landmarks
    from studio.cli.console import console, findings_json, print_findings, print_json, progress
    from studio.inputs import scene_of
    from studio.landmark_sheet import landmark_sheet
    from studio.sheet import save_png

    if detector not in DETECTORS:
        usage(f"--detector {detector}: choose {' or '.join(DETECTORS)}")
    check_outputs(output, None, sheet, inputs=(face, given))
    known = read_face(source)
    scene = scene_of(read(face))
    with progress() as tell:
        prepared = prepare(known.scene, known.feature_points, "source")
        clicked = None if given is None else read_landmarks(given, scene)
        found = detect_points(scene, prepared, clicked, detector=detector, progress=tell)
        write_landmarks(found.points, scene, output)
        findings = (*found.findings, *_covered(scene, found.points))
        if sheet is not None:
            turned, points, _ = orient(scene, found.points)
            save_png(landmark_sheet(turned, points, title=scene.name), sheet)
    if as_json:
        trust = {key: {"source": p.source, "confidence": p.confidence} for key, p in found.points.items()}
        print_json({"file": str(output), "points": trust, "findings": findings_json(findings)})
        return
    out = console()
    print_findings(findings, out)
    out.print(f"{output}: {len(found.points)} feature points")


def _covered(scene: FaceScene, points: FeaturePoints) -> list[Finding]:
    """Lips that are grown together and eyes that are closed or filled: their points lie on no edge."""
    from cloning.prepare import prepare

    try:
        found = prepare(scene, points, "target").findings
    except LandmarkError as error:
        return [Finding("warning", "unusable-points", str(error), scene.name)]
    return [f for f in found if f.code.startswith(("sealed-", "closed-"))]
