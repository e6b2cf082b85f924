from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from faces import small_face
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel

from fba import ShapeSet
from fba.errors import InputFileError
from formats import usd
from formats.usd.validate import validate_stage

SKIN = "/small/skin"


@pytest.fixture
def written(tmp_path: Path) -> Path:
    path = tmp_path / "face.usda"
    (tmp_path / "face.png").write_bytes(b"")
    usd.write(small_face(), path)
    return path


@pytest.mark.parametrize("extension", ["usda", "usdc", "usd"])
def test_written_files_are_clean(tmp_path: Path, extension: str, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "face.png").write_bytes(b"")
    face = small_face()
    path = tmp_path / f"face.{extension}"
    usd.write(face, path)
    assert validate_stage(path) == []
    usd.write(face.scene, path)
    assert validate_stage(path) == []
    neutral = face.scene.world_neutral()
    usd.write_shape_set(face.scene, ShapeSet(("smile",), neutral, np.ones((1, *neutral.shape))), path)
    assert validate_stage(path) == []
    assert capfd.readouterr() == ("", "")


def _attribute(path: str, name: str, value: object) -> Callable[[Usd.Stage], None]:
    def change(stage: Usd.Stage) -> None:
        attribute = stage.GetPrimAtPath(path).GetAttribute(name)
        assert attribute
        assert attribute.Set(value)

    return change


def _remove_skel_binding(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath(SKIN).RemoveAPI(UsdSkel.BindingAPI)


def _no_skel_root(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath("/small").SetTypeName("Xform")


def _no_default_prim(stage: Usd.Stage) -> None:
    stage.ClearDefaultPrim()


def _no_up_axis(stage: Usd.Stage) -> None:
    stage.ClearMetadata("upAxis")


def _no_unit(stage: Usd.Stage) -> None:
    stage.ClearMetadata("metersPerUnit")


def _no_extent(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath(SKIN).RemoveProperty("extent")


def _lost_target(stage: Usd.Stage) -> None:
    stage.RemovePrim(f"{SKIN}/open_jaw")


def _wrong_target(stage: Usd.Stage) -> None:
    targets = UsdSkel.BindingAPI(stage.GetPrimAtPath(SKIN)).GetBlendShapeTargetsRel()
    targets.SetTargets([Sdf.Path("/small/Materials"), *targets.GetTargets()[1:]])


def _inbetween_weight(stage: Usd.Stage) -> None:
    UsdSkel.BlendShape(stage.GetPrimAtPath(f"{SKIN}/open_jaw")).GetInbetween("at_400").SetWeight(0.9)


def _inbetween_at_one(stage: Usd.Stage) -> None:
    UsdSkel.BlendShape(stage.GetPrimAtPath(f"{SKIN}/open_jaw")).GetInbetween("at_400").SetWeight(1.0)


def _inbetween_count(stage: Usd.Stage) -> None:
    blend = UsdSkel.BlendShape(stage.GetPrimAtPath(f"{SKIN}/open_jaw"))
    blend.GetInbetween("at_400").SetOffsets([Gf.Vec3f(1)])


def _normal_offsets(stage: Usd.Stage) -> None:
    UsdSkel.BlendShape(stage.GetPrimAtPath(f"{SKIN}/open_jaw")).CreateNormalOffsetsAttr([Gf.Vec3f(1)])


def _subset(stage: Usd.Stage) -> None:
    UsdGeom.Subset(stage.GetPrimAtPath(f"{SKIN}/material_face")).GetIndicesAttr().Set([0, 77])


def _weights_count(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath("/small/Animation").GetAttribute("blendShapeWeights").Set([0.0], 5)


JAW = f"{SKIN}/open_jaw"
NAMES = ["viseme_PP", "expression_surprise", "open_jaw", "raise_b_midlip", "thrust_jaw"]
BREAKS: dict[str, tuple[Callable[[Usd.Stage], None], str]] = {
    "binding not applied": (_remove_skel_binding, "MissingSkelBindingAPI"),
    "no SkelRoot": (_no_skel_root, "InvalidSkelBindingAPIApply"),
    "no default prim": (_no_default_prim, "MissingDefaultPrim"),
    "no up axis": (_no_up_axis, "MissingUpAxisMetadata"),
    "no unit": (_no_unit, "MissingMetersPerUnitMetadata"),
    "point index too large": (_attribute(JAW, "pointIndices", [0, 1, 8]), "usd-point-indices"),
    "point index negative": (_attribute(JAW, "pointIndices", [0, 1, -1]), "usd-point-indices"),
    "offsets too few": (_attribute(JAW, "offsets", [Gf.Vec3f(1)]), "usd-offsets-count"),
    "offsets without indices": (_attribute(JAW, "pointIndices", []), "usd-offsets-count"),
    "offsets not finite": (_attribute(JAW, "offsets", [Gf.Vec3f(float("nan"))] * 3), "usd-offsets"),
    "normal offsets too few": (_normal_offsets, "usd-offsets-count"),
    "inbetween offsets too few": (_inbetween_count, "usd-offsets-count"),
    "inbetween elsewhere": (_inbetween_weight, "usd-interval-borders"),
    "inbetween at one": (_inbetween_at_one, "usd-inbetween-weight"),
    "borders without zero": (_attribute(JAW, "fba:intervalBorders", [1, 2, 3]), "usd-interval-borders"),
    "slopes too few": (_attribute(JAW, "fba:slopes", [Gf.Vec3f(1)]), "usd-slopes"),
    "names without targets": (_attribute(SKIN, "skel:blendShapes", NAMES[:-1]), "usd-target-count"),
    "a name twice": (_attribute(SKIN, "skel:blendShapes", [*NAMES[:-1], NAMES[0]]), "usd-target-names"),
    "target removed": (_lost_target, "usd-target"),
    "target of another kind": (_wrong_target, "usd-target"),
    "animation of an unknown shape": (
        _attribute("/small/Animation", "blendShapes", [*NAMES[:-1], "wink"]),
        "usd-animation-names",
    ),
    "weights too few": (_weights_count, "usd-animation-weights"),
    "face index too large": (
        _attribute(SKIN, "faceVertexIndices", [0, 1, 2, 3, 7, 1, 0, 3, 2, 4, 3, 4, 6, 5, 8]),
        "usd-face-indices",
    ),
    "face indices too few": (_attribute(SKIN, "faceVertexIndices", [0, 1, 2]), "usd-face-indices"),
    "two corners": (_attribute(SKIN, "faceVertexCounts", [4, 3, 2, 6]), "usd-face-counts"),
    "points not finite": (_attribute(SKIN, "points", [Gf.Vec3f(float("inf"))] * 8), "usd-points"),
    "no extent": (_no_extent, "usd-extent"),
    "extent too small": (_attribute(SKIN, "extent", [Gf.Vec3f(0), Gf.Vec3f(1)]), "usd-extent"),
    "extent of one point": (_attribute(SKIN, "extent", [Gf.Vec3f(0)]), "usd-extent"),
    "subset outside": (_subset, "InvalidSubsetFamily"),
}


@pytest.mark.parametrize("what", BREAKS)
def test_what_is_broken_is_found(written: Path, what: str, capfd: pytest.CaptureFixture[str]) -> None:
    change, code = BREAKS[what]
    stage = Usd.Stage.Open(str(written))
    change(stage)
    stage.GetRootLayer().Save()
    del stage
    findings = validate_stage(written)
    assert code in {f.code for f in findings}, findings
    assert all(f.message and "\n" not in f.message for f in findings)
    assert capfd.readouterr() == ("", "")


def test_a_missing_texture_is_found(written: Path) -> None:
    (written.parent / "face.png").unlink()
    assert any("face.png" in f.message for f in validate_stage(written))


def test_what_is_no_stage_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "no.usda"
    path.write_text("solid")
    with pytest.raises(InputFileError):
        validate_stage(path)
