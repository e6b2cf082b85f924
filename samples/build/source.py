"""Assemble the shipped source face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fat.build import build_tables
from fat.compact import compact
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.rig import RigTables, rig_eye, rig_head
from fat.tables import table_name
from fba.fapu import FAPU_DIVISOR
from fba.scene import FaceScene
from samples.build.colors import skin_materials
from samples.build.fine import fine
from samples.build.head import Head, build_head, macro
from samples.build.high_level import high_level_motions
from samples.build.low_level import RECIPES
from samples.build.makehuman import MakeHuman
from samples.build.motions import MotionBuilder
from samples.build.neutral import neutral
from samples.build.symmetry import SymmetricMakeHuman

RACES = {"caucasian": 0.35, "asian": 0.35, "african": 0.3}
SEXES = {"female": 0.6, "male": 0.4}
LID_OPENING = 0.155
"""Of the eye separation: nearly MakeHuman's own; the iris is as wide."""
THRUST = 40
"""Border of the eyeball thrust, FAP 27 and 28."""


def source_head(makehuman: MakeHuman) -> Head:
    """The source's neutral head: a mixture of all races and both sexes, symmetric, smooth, in the neutral pose."""
    mixture: dict[tuple[str, str], float] = {}
    for race, share in RACES.items():
        for sex, part in SEXES.items():
            for key, weight in macro(race, sex, "young", share * part).items():
                mixture[key] = mixture.get(key, 0.0) + weight
    coarse = build_head(SymmetricMakeHuman(makehuman.read), mixture, "source")
    return neutral(fine(coarse), LID_OPENING)


def build_source(makehuman: MakeHuman) -> AnimatableFace:
    """The animatable source: scene with nested eye and head rotations, feature points, tables."""
    head = source_head(makehuman)
    builder = MotionBuilder(head)
    motions = [motion for recipe in RECIPES for motion in builder.fap_motions(recipe)]
    motions += eye_thrusts(head)
    motions += high_level_motions(builder)
    scene, transforms = _rig(head, colored(head))
    tables = compact(build_tables(scene, head.fapu, motions, transforms), head.fapu)
    notes = {table_name(r.fap): r.note for r in RECIPES if r.note}
    return AnimatableFace(scene, head.points, tables, head.fapu, notes)


def eye_thrusts(head: Head) -> list[FaceMotion]:
    """FAPs 27 and 28: the whole eyeball moves along +Z."""
    out = []
    for fap_id, shape in ((27, "eye_left"), (28, "eye_right")):
        count = head.scene.shape(shape).mesh.vertex_count
        offsets = np.tile([0.0, 0.0, THRUST * head.fapu.es0 / FAPU_DIVISOR], (count, 1))
        out.append(FaceMotion(table_name(fap_id), fap_id, 1, THRUST, {shape: offsets}))
    return out


def colored(head: Head) -> FaceScene:
    """The head's scene with lips and mouth in their own colours."""
    skin = head.scene.shape("skin")
    mesh = replace(skin.mesh, face_materials=skin_materials(head))
    return head.scene.map_shapes({"skin": replace(skin, mesh=mesh)})


def _rig(head: Head, scene: FaceScene) -> tuple[FaceScene, RigTables]:
    tables: RigTables = {}
    for side in ("left", "right"):
        name = f"eye_{side}"
        scene, more = rig_eye(scene, side, [name], head.eye_centers[name][0])
        tables |= more
    scene, more = rig_head(scene, head.positions["7.1"])
    return scene, tables | more
