"""A clone beside its source: do all motions that both have move the feature points alike?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fat.build import face_motions
from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fat.held_out import held_out_error
from fat.motion import FaceMotion
from fat.quality import fap_error, fap_values, feature_point_motion, flips, lid_gap, lip_gap_change
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.high_level import BLEND_MAX
from fba.scene import Role

BLINK = {19: 1024.0, 20: 1024.0}


@dataclass(frozen=True, slots=True)
class Fidelity:
    """A clone beside its source; means and worst values over the motions that both have.

    fp_error : relative error over all feature points and FAP axes (0.01 = 1 %).
    unasked : motions whose feature points stay still on the source, but not on the clone.
    lip_gap : largest change of the lips' opening in MNS.
    lid_gap : how much wider the worse eye stays open after a blink, in IRISD; None without eyelid FAPs.
    flips : percent of moving skin triangles turned by more than 90 degrees.
    held_out : relative error over the points that no FAP names, see `fat.held_out`; all motions together.
    *_key, *_point : FAP, select and value of the worst motion, and the worst feature point.
    """

    motions: int
    unasked: tuple[str, ...]
    fp_error_mean: float
    fp_error_worst: float
    fp_error_worst_motion: str
    lip_gap: float
    lip_gap_motion: str
    lid_gap: float | None
    flips_mean: float
    source_flips_mean: float
    held_out: float = 0.0
    held_out_point: str | None = None
    fp_error_worst_key: tuple[int, int, int] | None = None
    lip_gap_key: tuple[int, int, int] | None = None
    lid_gap_point: str | None = None


def fidelity(face: AnimatableFace, source: AnimatableFace) -> Fidelity | None:
    """Compare every motion that both faces have; None if there is none."""
    mine = {(m.fap_id or 0, m.select, m.value): m for m in face_motions(face)}
    theirs = {(m.fap_id or 0, m.select, m.value): m for m in face_motions(source)}
    common = [key for key in theirs if key in mine]
    if not common:
        return None
    pairs = {key: (_points(source, theirs[key]), _points(face, mine[key])) for key in common}
    errors = {
        k: fap_error(fap_values(a, source.fapu), fap_values(b, face.fapu)).relative for k, (a, b) in pairs.items()
    }
    lips = {k: lip_gap_change(a, source.fapu, b, face.fapu) for k, (a, b) in pairs.items()}
    finite = {k: v for k, v in errors.items() if np.isfinite(v)}
    worst = max(finite, key=lambda k: finite[k], default=None)
    lip = max(lips, key=lambda k: lips[k])
    names = {k: f"{theirs[k].name} at {theirs[k].value}" for k in common}
    ours, yours = Player(face, rules=()), Player(source, rules=())
    lids = _lid_gap_beyond(ours, yours)
    held_out, held_out_point = held_out_error(pairs.values(), source.fapu.es0, face.fapu.es0)
    return Fidelity(
        motions=len(common),
        unasked=tuple(names[k] for k in errors if k not in finite),
        fp_error_mean=float(np.mean(list(finite.values()))) if finite else 0.0,
        fp_error_worst=0.0 if worst is None else finite[worst],
        fp_error_worst_motion="" if worst is None else names[worst],
        lip_gap=lips[lip],
        lip_gap_motion=names[lip],
        lid_gap=None if lids is None else lids[0],
        flips_mean=_flips(ours, yours),
        source_flips_mean=_flips(yours, ours),
        held_out=held_out,
        held_out_point=held_out_point,
        fp_error_worst_key=worst,
        lip_gap_key=lip,
        lid_gap_point=None if lids is None else lids[1],
    )


def _points(face: AnimatableFace, motion: FaceMotion) -> dict[str, Floats]:
    return feature_point_motion(face.feature_points, motion.offsets)


def _flips(player: Player, other: Player) -> float:
    """Mean share of flipped triangles, in percent, at the normal amplitudes of all motions that both faces have."""
    face = player.face
    keys = {t.key for t in face.tables if t.meshes} & {t.key for t in other.face.tables if t.meshes}
    skins = [(s.name, face.scene.world_vertices(s.name), s.mesh.triangles) for s in face.scene.with_role(Role.SKIN)]
    values = []
    for pose in (pose for key in sorted(keys) for pose in _normal_poses(player, *key)):
        moved = pose.world_shapes()
        for name, vertices, triangles in skins:
            offsets = moved[name] - vertices
            if offsets.any():
                values.append(flips(vertices, triangles, offsets))
    return float(np.mean(values)) if values else 0.0


def _normal_poses(player: Player, fap_id: int, select: int) -> Iterator[Pose]:
    if fap_id == VISEME_FAP:
        yield player.pose(viseme=(select, 0, BLEND_MAX))
    elif fap_id == EXPRESSION_FAP:
        yield player.pose(expression=(select, BLEND_MAX, 0, 0))
    else:
        for value in amplitudes()[fap_id].values:
            yield player.pose({fap_id: value})


def _lid_gap_beyond(ours: Player, theirs: Player) -> tuple[float, str] | None:
    """How much wider the worse eye stays open after a blink, IRISD, and its upper lid's point."""
    gaps: list[Mapping[str, float]] = []
    for player in (theirs, ours):
        one = player.face
        if any(one.tables.get(number) is None for number in BLINK):
            return None
        rest = one.feature_points.positions(one.scene)
        moved = one.feature_points.positions(one.scene, player.pose(BLINK).world_shapes())
        gaps.append(lid_gap(rest, {k: moved[k] - rest[k] for k in rest}, one.fapu))
    common = sorted(gaps[0].keys() & gaps[1].keys())
    return max(((gaps[1][k] - gaps[0][k], k.split("/")[0]) for k in common), default=None)
