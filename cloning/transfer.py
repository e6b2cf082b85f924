"""Carry motions of a whole face: skin, lower teeth, tongue, eyeballs, and what rides on the skin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cloning.backends import Anchored, SkinTransfer
from cloning.bind import NOTHING, Binding
from cloning.bodies import Body, Mover, body, eye_mover, teeth_mover, tongue_mover
from cloning.closed_eyes import HALF, calm_lids, closed_lids
from cloning.correct import Correction, correction
from cloning.eyeballs import EyeGuard, eye_guard
from cloning.normalize import ratios
from cloning.prepare import PreparedFace
from cloning.rims import RimFollower, rim_follower
from fba.arrays import Floats
from fba.findings import Finding
from fba.scene import Role, Shape

CHUNK = 24
"""Motions carried in one go; keeps the memory of a fine source below a few hundred MB."""

MISSED = 0.01
"""An error of a feature point worth telling, in eye separations."""

INNER_LIPS = ("2.2", "2.3", "2.6", "2.7", "2.8", "2.9")

Offsets = Mapping[str, Floats]


@dataclass
class Tally:
    """Sums of what feature points miss, over all motions.

    Attributes
    ----------
    before, after : of the bare transfer, and of the finished skin; largest : the most that the latter misses.
    left : feature point -> the most that the correction leaves, in eye separations.
    """

    before: float = 0.0
    after: float = 0.0
    wanted: float = 0.0
    largest: float = 0.0
    left: dict[str, float] = field(default_factory=dict)

    def add(self, wanted: Floats, before: Floats, after: Floats, es0: float) -> None:
        """Count some motions; arrays (k, K, 3) and the eye separation in the same unit."""
        self.largest = max(self.largest, float(np.abs(after).max(initial=0.0)) / es0)
        self.before += float(np.abs(before).sum())
        self.after += float(np.abs(after).sum())
        self.wanted += float(np.abs(wanted).sum())

    def note_left(self, ids: Sequence[str], left: Floats) -> None:
        """Keep the largest of what the correction leaves, (k, K, 3), for each feature point."""
        for key, missed in zip(ids, np.abs(left).max(axis=(1, 2)), strict=True):
            self.left[key] = max(self.left.get(key, 0.0), float(missed))

    def measures(self) -> dict[str, float]:
        total = max(self.wanted, 1e-300)
        return {
            "fp_error_before": self.before / total,
            "fp_error_after": self.after / total,
            "fp_error_worst_es": self.largest,
        }


@dataclass(frozen=True, eq=False)
class FaceTransfer:
    """Everything that is needed to carry any motion from one face to another.

    Attributes
    ----------
    source, target : the prepared faces.
    skin : the backend's transfer.
    correction : bumps that make the feature points exact; None in published mode.
    ids : the feature points that are measured (and corrected).
    bodies : (source's body, target's body, mover) of each part that both faces have.
    bindings : shape name -> how it rides on the skin.
    rims : closes the lids along their whole length; None in published mode.
    guard : keeps the skin off the eyeballs; None in published mode.
    calm : (n,) share of their motion that is left to the lids of closed eyes; None where there are none.
    """

    source: PreparedFace
    target: PreparedFace
    skin: SkinTransfer
    correction: Correction | None
    ids: tuple[str, ...]
    bodies: Sequence[tuple[Body, Body, Callable[[dict[str, Floats]], Mover]]]
    bindings: Mapping[str, Binding]
    rims: RimFollower | None = None
    guard: EyeGuard | None = None
    calm: Floats | None = None
    findings: tuple[Finding, ...] = ()
    tally: Tally = field(default_factory=Tally)

    def apply(self, motions: Sequence[Offsets], tick: Callable[[float], None] | None = None) -> list[dict[str, Floats]]:
        """Carry motions: each a mapping shape -> (n, 3) world offsets, mesh units.

        Returns
        -------
        The same for the target; shapes that rest are absent.
        """
        out: list[dict[str, Floats]] = []
        skin = self.skin.anchored(self._reach(motions)) if isinstance(self.skin, Anchored) else self.skin
        for start in range(0, len(motions), CHUNK):
            out += self._chunk(skin, motions[start : start + CHUNK])
            if tick is not None:
                tick(min(start + CHUNK, len(motions)) / len(motions))
        return out

    def inexact(self) -> list[Finding]:
        """Say which feature points could not be made exact, after `apply`."""
        names = [key for key, missed in self.tally.left.items() if missed > MISSED]
        if self.correction is None or not names:
            return []
        text = (
            f"feature points {', '.join(names)} miss their motion by up to {max(self.tally.left.values()):.2f} eye "
            "separations: on this coarse mesh they share triangles with others that move differently"
        )
        return [Finding("warning", "inexact-points", text, self.target.scene.name)]

    def _reach(self, motions: Sequence[Offsets]) -> Floats:
        """(n,) how far the motions move each vertex of the source's skin at most."""
        farthest = np.zeros(self.source.skin.vertex_count)
        for motion in motions:
            np.maximum(farthest, np.linalg.norm(self.source.skin.join(motion), axis=1), out=farthest)
        return farthest

    def _chunk(self, transfer: SkinTransfer, motions: Sequence[Offsets]) -> list[dict[str, Floats]]:
        moving = np.stack([self.source.skin.join(m) for m in motions], axis=1)
        skin = transfer.apply(moving)
        wanted = self._wanted(moving)
        if self.calm is not None:
            calm_lids(skin, self.calm)
            wanted *= (self.target.skin.point_matrix(self.ids) @ self.calm > HALF)[:, None, None]
        before = wanted - self._at_points(skin)
        if self.correction is not None:
            self.tally.note_left(self.ids, self.correction.apply(skin, wanted) / self.target.fapu.es0)
        if self.rims is not None:
            self.rims.apply(moving, skin)
        if self.guard is not None:
            self.guard.apply(moving, skin)
        self.tally.add(wanted, before, wanted - self._at_points(skin), self.target.fapu.es0)
        done: dict[str, Floats] = dict(self.target.skin.split(skin))
        for mine, yours, mover in self.bodies:
            offsets = mine.join(motions)
            if np.any(offsets):
                done.update(yours.split(mover(done)(offsets)))
        for name, binding in self.bindings.items():
            done[name] = binding.apply(skin)
        moved = {name: np.any(values != 0.0, axis=(0, 2)) for name, values in done.items()}
        return [
            {name: np.ascontiguousarray(values[:, k]) for name, values in done.items() if moved[name][k]}
            for k in range(len(motions))
        ]

    def _wanted(self, moving: Floats) -> Floats:
        """(k, K, 3) offsets that the feature points shall have: the source's, scaled by the FAPUs."""
        rows = self.source.skin.point_matrix(self.ids)
        found = (rows @ moving.reshape(len(moving), -1)).reshape(len(self.ids), moving.shape[1], 3)
        scaled: Floats = found * ratios(self.source.fapu, self.target.fapu, self.ids)[:, None]
        return scaled

    def _at_points(self, skin: Floats) -> Floats:
        rows = self.target.skin.point_matrix(self.ids)
        found: Floats = (rows @ skin.reshape(len(skin), -1)).reshape(len(self.ids), skin.shape[1], 3)
        return found


def build_face_transfer(
    source: PreparedFace, target: PreparedFace, skin: SkinTransfer, as_published: bool
) -> FaceTransfer:
    """Pair up the parts of two faces.

    Parameters
    ----------
    as_published : teeth and tongue only translate, nothing rides on the skin, feature points are not corrected.
    """
    ids, doubled = _measured(source, target)
    bodies, findings = _pair(source, target, as_published)
    if doubled:
        text = f"feature points {', '.join(doubled)} lie at the place of another point; they move like that one"
        findings.append(Finding("warning", "doubled-points", text, target.scene.name))
    bindings: dict[str, Binding] = {}
    if not as_published:
        bindings = {s.name: _bound(target, s) for s in target.scene.with_role(Role.OTHER) if s.mesh.face_count}
    return FaceTransfer(
        source,
        target,
        skin,
        None if as_published else correction(target.skin, ids),
        ids,
        bodies,
        bindings,
        None if as_published else rim_follower(source, target),
        None if as_published else eye_guard(source, target, skin.carry),
        None if as_published else closed_lids(target.skin, target.labels.closed),
        tuple(findings),
    )


def _bound(target: PreparedFace, shape: Shape) -> Binding:
    """How a shape rides on the target's skin."""
    resting, lying = (some.get(shape.name, NOTHING) for some in (target.parts.resting, target.parts.lying))
    vertices = target.scene.world_vertices(shape.name) / target.fapu.es0
    return Binding(vertices, shape.mesh.indices, shape.mesh.offsets, target.skin, resting, lying)


def _measured(source: PreparedFace, target: PreparedFace) -> tuple[tuple[str, ...], list[str]]:
    """Feature points that can be made exact one by one, and those at the very place of another.

    Points of touching lips are at one place in space, but on different vertices.
    """
    taken: dict[tuple[tuple[int, float], ...], str] = {}
    doubled: list[str] = []
    for key, (vertices, weights) in target.skin.points.items():
        if key not in source.skin.points or (1 in target.labels.sealed and key in INNER_LIPS):
            continue
        place = tuple(sorted((int(v), round(float(w), 3)) for v, w in zip(vertices, weights, strict=True) if w > 1e-3))
        if place in taken:
            doubled.append(key)
        else:
            taken[place] = key
    return tuple(taken.values()), doubled


def _pair(
    source: PreparedFace, target: PreparedFace, as_published: bool
) -> tuple[list[tuple[Body, Body, Callable[[dict[str, Floats]], Mover]]], list[Finding]]:
    pairs: list[tuple[Body, Body, Callable[[dict[str, Floats]], Mover]]] = []
    findings: list[Finding] = []
    for role in (Role.LOWER_TEETH, Role.TONGUE, Role.EYE_LEFT, Role.EYE_RIGHT):
        mine, yours = body(source, role), body(target, role)
        if yours is None:
            continue
        if mine is None:
            words = role.value.replace("_", " ")
            findings.append(
                Finding(
                    "warning",
                    f"source-no-{role.value.replace('_', '-')}",
                    f"the source has no {words}, so nothing moves the target's {words}",
                    target.scene.name,
                )
            )
            continue
        pairs.append((mine, yours, _mover(source, target, mine, yours, role, as_published)))
    return pairs, findings


def _mover(
    source: PreparedFace, target: PreparedFace, mine: Body, yours: Body, role: Role, as_published: bool
) -> Callable[[dict[str, Floats]], Mover]:
    if role is Role.LOWER_TEETH or (role is Role.TONGUE and as_published):
        fixed = teeth_mover(source, target, mine, yours, turning=not as_published)
        return lambda _: fixed
    if role is not Role.TONGUE:
        ball = eye_mover(source, target, mine, yours, role)
        return lambda _: ball
    lower = body(target, Role.LOWER_TEETH)
    found: dict[str, Floats] = {}

    def jaw() -> Floats | None:
        if lower is None or any(name not in found for name in lower.names):
            return None
        return np.concatenate([found[name] for name in lower.names])

    tongue = tongue_mover(source, target, mine, yours, jaw)

    def with_teeth(done: dict[str, Floats]) -> Mover:
        found.clear()
        found.update(done)
        return tongue

    return with_teeth
