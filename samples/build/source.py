"""Assemble the shipped source face: MakeHuman's head and face units, authored as any other face is."""

from __future__ import annotations

from dataclasses import replace

from authoring.author import author
from authoring.riders import carried
from cloning.prepare import prepare
from fat.compact import compact
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.scene import FaceScene
from samples.build.colors import skin_materials
from samples.build.fine import fine
from samples.build.head import Head, build_head, mean_mixture
from samples.build.makehuman import ARKIT_UNITS, MakeHuman
from samples.build.neutral import neutral
from samples.build.symmetry import SymmetricMakeHuman

LID_OPENING = 0.155
"""Of the eye separation: nearly MakeHuman's own; the iris is as wide."""
TEETH_SHOWN = 0.035
"""Of the eye separation: the edge of human upper incisors lies about two millimetres below the resting upper lip."""


def source_head(makehuman: MakeHuman) -> Head:
    """The source's neutral head: a mixture of all races and both sexes, symmetric, smooth, in the neutral pose."""
    coarse = build_head(SymmetricMakeHuman(makehuman.read), mean_mixture(), "source")
    return neutral(fine(coarse), LID_OPENING, TEETH_SHOWN)


def build_source(makehuman: MakeHuman) -> AnimatableFace:
    """The animatable source: scene with nested eye and head rotations, feature points, tables."""
    head = source_head(makehuman)
    scene = colored(head)
    face, _ = author(scene, head.points, source_units(head, scene))
    return replace(face, tables=compact(face.tables, face.fapu))


def source_units(head: Head, scene: FaceScene) -> dict[str, dict[str, Floats]]:
    """MakeHuman's face units on the source; the lashes, which were planted anew, ride on the lids."""
    face = prepare(scene, head.points, "source")
    units = {}
    for name in ARKIT_UNITS:
        unit = head.unit(name)
        riding = carried(face, unit["skin"] / face.fapu.es0)
        units[name] = {**unit, **{shape: face.fapu.es0 * offsets for shape, offsets in riding.items()}}
    return units


def colored(head: Head) -> FaceScene:
    """The head's scene with lips and mouth in their own colours."""
    skin = head.scene.shape("skin")
    mesh = replace(skin.mesh, face_materials=skin_materials(head))
    return head.scene.map_shapes({"skin": replace(skin, mesh=mesh)})
