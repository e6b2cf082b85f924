"""Build the shapes of a profile from a face's tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.open_jaw import open_jaw_mode
from fat.profiles.tables import Profile, ProfileShape, profile_table
from fat.tables import table_name
from fba.arrays import Floats
from fba.errors import FaceDefTablesError
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.findings import Finding
from fba.high_level import BLEND_MAX
from fba.orientation import to_file_order
from fba.shapes import ShapeSet

RULES = ("corners",)
"""Of `fat.combine`: where inner and outer lip corner are tied, the two FAPs of a shape move the corner once. The rest
is the standard's sum: a shape such as mouthClose is meant to be added to others."""

OPENING, CLOSING = "jawOpen", "mouthClose"
"""ARKit's mouthClose is added to jawOpen and shuts the lips again."""

_Key = tuple[int, int]


def profile_shapes(
    face: AnimatableFace, profile: Profile, shut: AnimatableFace | None = None
) -> tuple[ShapeSet, list[Finding]]:
    """Evaluate every shape of a profile on a face, all its parts.

    Parameters
    ----------
    face : its tables make the shapes. FAPs that it has no tables for are left out of them.
    shut : the same face with an open_jaw that leaves the lips (`authoring.open_jaw.strict`). Then mouthClose is what
        keeps the lips of jawOpen together; without it, it is made of lip FAPs, which tear them.

    Returns
    -------
    shapes : in the file's own axes, units and vertex order; shapes of which the face has no FAP at all are left out.
    findings : shapes that are not whole, and why.

    Raises
    ------
    FaceDefTablesError
        If the face can show no shape of the profile, or its tables are damaged.
    """
    player = Player(face, rules=RULES)
    strict = open_jaw_mode(face) == "strict"
    neutral = face.scene.world_neutral()
    names, deltas = [], []
    partial: dict[str, list[_Key]] = {}
    gone: dict[str, list[_Key]] = {}
    for row in profile_table(profile):
        shape = replace(row, faps=row.strict_faps) if strict and row.strict_faps else row
        wanted = _keys(shape)
        missing = [key for key in wanted if face.tables.get(*key) is None]
        if missing:
            (gone if len(missing) == len(wanted) else partial)[shape.name] = missing
        if shape.still or len(missing) < len(wanted):
            names.append(shape.name)
            deltas.append(to_file_order(face.scene, _world(player, shape) - neutral))
    if shut is not None and CLOSING in names and OPENING in names:
        opening = next(row for row in profile_table(profile) if row.name == OPENING)
        closing = _world(Player(shut, rules=RULES), opening) - _world(player, opening)
        deltas[names.index(CLOSING)] = to_file_order(face.scene, closing)
    if not any(map(np.any, deltas)):
        raise FaceDefTablesError(
            f"the tables of '{face.scene.name}' move none of the shapes of the profile '{profile}'; "
            "`fba inspect` lists the FAPs that they have"
        )
    shapes = ShapeSet(tuple(names), to_file_order(face.scene, neutral), np.stack(deltas))
    return shapes, _incomplete(gone, partial, face.scene.name)


def _world(player: Player, shape: ProfileShape) -> Floats:
    """(N, 3) vertices with the shape at weight 1; inside axes."""
    viseme = (shape.viseme, 0, BLEND_MAX) if shape.viseme else None
    expression = (shape.expression, shape.intensity, 0, 0) if shape.expression else None
    return player.pose(shape.faps, viseme, expression).world()


def _keys(shape: ProfileShape) -> list[_Key]:
    """(fap_id, high_level_select) of the tables that a shape needs."""
    keys = [(number, 1) for number in shape.faps]
    if shape.viseme:
        keys.append((VISEME_FAP, shape.viseme))
    if shape.expression:
        keys.append((EXPRESSION_FAP, shape.expression))
    return keys


def _incomplete(gone: Mapping[str, Sequence[_Key]], partial: Mapping[str, Sequence[_Key]], where: str) -> list[Finding]:
    """Which shapes lack what."""
    findings = []
    if gone:
        text = f"shapes that are left out, as the face has no table for any part of them: {_listed(gone)}"
        findings.append(Finding("warning", "profile-shapes-missing", text, where))
    if partial:
        text = f"shapes that lack a part for which the face has no table: {_listed(partial)}"
        findings.append(Finding("warning", "profile-shapes-partial", text, where))
    return findings


def _listed(shapes: Mapping[str, Sequence[_Key]]) -> str:
    return ", ".join(f"{name} ({', '.join(map(_named, keys))})" for name, keys in shapes.items())


def _named(key: _Key) -> str:
    return table_name(*key) if key[0] <= EXPRESSION_FAP else f"FAP {key[0]}"
