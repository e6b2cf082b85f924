"""Ways to spoil a clone by an amount, for faults that no limit was chosen by: see `benchmarks.held_out_faults`."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.measures import Bench
from fat.build import build_tables, face_motions
from fat.conformance import conformance
from fat.face import AnimatableFace
from fat.held_out import NAMED
from fat.motion import FaceMotion
from fat.tables import FaceDefTables
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.scene import Role
from formats import read_face
from studio.checked_skin import CheckedSkin, check_skin, common_points
from studio.judging import measure

LENGTHS = (0.005, 0.015, 0.05, 0.15)
"""Eye separations: .3, 1, 3 and 9 mm in an adult."""
TENTHS = tuple(x / 10.0 for x in LENGTHS)
SHARES = (0.01, 0.05, 0.2, 0.5)
ES, SHARE = "eye sep.", "of the motion"

Change = Callable[[Floats, FaceMotion], Floats]


@dataclass(frozen=True)
class Dose:
    """A way to spoil a face by an amount.

    Attributes
    ----------
    strengths : from barely visible to gross, in `unit`.
    its, kin : see `benchmarks.measures.Fault`.
    spoil : (the good face, strength) to the spoilt one.
    """

    name: str
    unit: str
    strengths: tuple[float, ...]
    its: str
    kin: tuple[str, ...]
    spoil: Callable[[Bench, float], AnimatableFace]


def some_motions(keys: Collection[tuple[int, int]]) -> AnimatableFace:
    """The shipped source with these motions alone, each a FAP and a select."""
    source = read_face("default")
    return replace(source, tables=FaceDefTables(tuple(t for t in source.tables if t.key in keys)))


def beside_source(face: AnimatableFace, skin: CheckedSkin, source: AnimatableFace) -> Bench:
    """A clone beside the face it was cloned from."""
    other = check_skin(source)
    points = common_points(skin, other)
    return Bench(face, skin, source, measure(source, 0.0, conformance(source), other, points), points)


def spoilt(b: Bench, fap_id: int | None, change: Change, select: int = 1) -> AnimatableFace:
    """The good face with the skin's offsets (n, 3), in eye separations, of one motion changed; None: all."""
    surface, es0 = b.skin.surface, b.face.fapu.es0
    motions = []
    for motion in face_motions(b.face):
        if fap_id is None or (motion.fap_id, motion.select) == (fap_id, select):
            still = {n: np.zeros_like(b.face.scene.world_vertices(n)) for n in surface.shapes}
            joined = np.concatenate([{**still, **motion.offsets}[n] for n in surface.shapes]) / es0
            motion = replace(motion, offsets={**motion.offsets, **surface.split(es0 * change(joined, motion))})
        motions.append(motion)
    return rebuilt(b.face, motions)


def rebuilt(face: AnimatableFace, motions: list[FaceMotion]) -> AnimatableFace:
    """A face with other motions of its skin and parts."""
    transforms = {t.key: t.transforms for t in face.tables}
    return replace(face, tables=build_tables(face.scene, face.fapu, motions, transforms))


def part(motion: FaceMotion) -> float:
    """A motion's value in parts of the positive one that is measured; 0 in the other direction."""
    if (motion.fap_id or 0) <= EXPRESSION_FAP:
        return 1.0
    return max(motion.value / max(amplitudes()[motion.fap_id or 0].values), 0.0)


def moved(b: Bench, fap_id: int, where: Floats, way: tuple[float, float, float], select: int = 1) -> AnimatableFace:
    """Skin goes a way more, in eye separations at the amplitude that is measured; where is (n, 1)."""
    return spoilt(b, fap_id, lambda d, m: d + part(m) * where * way, select)


def near_unnamed(b: Bench) -> Floats:
    """(n, 1) 1 at feature points that no FAP names, falling off around them."""
    keys = [k for k in b.skin.surface.positions if k not in NAMED and b.skin.surface.points.get(k)]
    near: Floats = np.maximum.reduce([b.near(k, 0.15) for k in keys])
    return near


def lining_pushed(b: Bench, viseme: int, length: float) -> AnimatableFace:
    """The lining comes forward in a viseme, by a length in eye separations."""
    lining = np.zeros((b.skin.surface.vertex_count, 1))
    lining[b.skin.lining] = 1.0
    return moved(b, 1, lining, (0.0, 0.0, length), select=viseme)


def part_moved(b: Bench, fap_id: int, role: Role, way: tuple[float, float, float]) -> AnimatableFace:
    """All shapes with a role go a way more, in eye separations at the amplitude that is measured."""
    names = {x.name: x.mesh.vertex_count for x in b.face.scene.with_role(role)}
    motions = []
    for motion in face_motions(b.face):
        if motion.fap_id == fap_id:
            step = np.array(way) * part(motion) * b.face.fapu.es0
            still = {n: np.zeros((k, 3)) for n, k in names.items()}
            more = {n: offsets + step for n, offsets in {**still, **motion.offsets}.items() if n in names}
            motion = replace(motion, offsets={**motion.offsets, **more})
        motions.append(motion)
    return rebuilt(b.face, motions)


def leaking(b: Bench, fap_id: int, other: int, share: float) -> AnimatableFace:
    """A FAP that also does a share of another FAP's motion."""
    theirs = [m for m in face_motions(b.face) if m.fap_id == other]
    names, es0 = b.skin.surface.shapes, b.face.fapu.es0
    still = {n: np.zeros_like(b.face.scene.world_vertices(n)) for n in names}

    def leaked(d: Floats, m: FaceMotion) -> Floats:
        near = min(theirs, key=lambda t: (t.value * m.value < 0, abs(t.value - m.value)))
        same = {**still, **near.offsets}
        added: Floats = d + share * m.value / near.value * np.concatenate([same[n] for n in names]) / es0
        return added

    return spoilt(b, fap_id, leaked)


def misplaced(b: Bench, key: str, way: tuple[float, float, float]) -> AnimatableFace:
    """A feature point at the vertex that can be seen and is nearest to a place, given by a way in eye widths."""
    places, skin = b.skin.surface.positions, b.skin.surface.vertices
    goal = places[key] + np.array(way) * float(np.linalg.norm(places["3.7"] - places["3.11"]))
    away = np.where(b.skin.seen, np.linalg.norm(skin - goal, axis=1), np.inf)
    vertex = int(np.argmin(away))
    (name,) = b.skin.surface.shapes
    point = FeaturePoint(name, (vertex,), (1.0,))
    return replace(b.face, feature_points=FeaturePoints({**b.face.feature_points, key: point}))


def wrinkled(b: Bench, fap_id: int, height: float, axis: int, length: float) -> AnimatableFace:
    """A motion with waves across an axis, as high as it is far; lengths in eye separations."""
    wave = np.sin(2.0 * np.pi * b.skin.surface.vertices[:, axis, None] / length)

    def waved(d: Floats, m: FaceMotion) -> Floats:
        size = np.linalg.norm(d, axis=1, keepdims=True)
        added: Floats = d + height * part(m) * wave * size / max(float(size.max()), 1e-12) * [0.0, 0.0, 1.0]
        return added

    return spoilt(b, fap_id, waved)


def mirrored_about(b: Bench, fap_id: int, key: str, reach: float, strength: float, select: int = 1) -> AnimatableFace:
    """Skin around a feature point pressed flat sideways (strength 1) or turned inside out (2) by a motion."""
    side = b.skin.surface.vertices[:, :1] - b.skin.surface.positions[key][0]
    near = b.near(key, reach)
    return spoilt(b, fap_id, lambda d, m: d - strength * min(part(m), 1.0) * near * side * [1.0, 0.0, 0.0], select)


def shaken(b: Bench, fap_id: int, share: float, seed: int) -> AnimatableFace:
    """Noise at every vertex, a share of the motion there."""
    shake = np.random.default_rng(seed).normal(size=b.skin.surface.vertices.shape)
    return spoilt(b, fap_id, lambda d, m: d + share * np.linalg.norm(d, axis=1, keepdims=True) * shake)
