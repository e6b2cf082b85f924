"""Faults that no limit was chosen by: other places, other motions and another head, each in four strengths.

Written before any of them was checked. Lengths go from .3 mm (barely visible) over 1 and 3 mm to 1 cm (gross), shares
of a motion from a hundredth to one half, whatever the measure's limit; unlike the faults of `benchmarks.measures`,
the face is read beside the shipped source, as a user would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.measures import AMOUNT, LIPS, SHAPE, Bench, good_clone
from fat.build import build_tables, face_motions
from fat.conformance import conformance
from fat.face import AnimatableFace
from fat.held_out import NAMED
from fat.motion import FaceMotion
from fat.tables import FaceDefTables
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP, fap
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.scene import Role
from formats import read_face
from studio.checked_skin import check_skin
from studio.judging import measure

HEAD = "faces/quad_head.obj"
FAPS = (5, 6, 18, 19, 20, 22, 33, 34, 41, 59, 61, 62)
HIGH = ((1, 2), (1, 5), (1, 10), (2, 1))
"""Visemes FF, kk and aa, and joy."""

LENGTHS = (0.005, 0.015, 0.05, 0.15)
"""Eye separations: .3, 1, 3 and 9 mm in an adult."""
SHARES = (0.01, 0.05, 0.2, 0.5)
ONE_SIDED = ("symmetry",)
"""This head is symmetric: whatever happens on one side only is seen by it, by definition."""

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


def held_out_bench() -> Bench:
    """The larger shipped head as a clone of the shipped source, beside that source; some of its motions."""
    keys = {(n, 1) for n in FAPS} | set(HIGH)
    source = read_face("default")
    source = replace(source, tables=FaceDefTables(tuple(t for t in source.tables if t.key in keys)))
    face, skin = good_clone(HEAD, source)
    return Bench(face, skin, source, measure(source, 0.0, conformance(source), check_skin(source)))


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
    return _built(b.face, motions)


def _built(face: AnimatableFace, motions: list[FaceMotion]) -> AnimatableFace:
    transforms = {t.key: t.transforms for t in face.tables}
    return replace(face, tables=build_tables(face.scene, face.fapu, motions, transforms))


def _part(motion: FaceMotion) -> float:
    """A motion's value in parts of the positive one that is measured; 0 in the other direction."""
    if (motion.fap_id or 0) <= EXPRESSION_FAP:
        return 1.0
    return max(motion.value / max(amplitudes()[motion.fap_id or 0].values), 0.0)


def _moved(b: Bench, fap_id: int, where: Floats, way: tuple[float, float, float], select: int = 1) -> AnimatableFace:
    """Skin goes a way more, in eye separations at the amplitude that is measured; where is (n, 1)."""
    return spoilt(b, fap_id, lambda d, m: d + _part(m) * where * way, select)


def lip_down(b: Bench, s: float) -> AnimatableFace:
    lower = (b.skin.labels == 2)[:, None]
    return _moved(b, 1, b.near("2.8", 0.25) * lower, (0.0, -s, 0.0), select=5)


def lip_into_lip(b: Bench, s: float) -> AnimatableFace:
    upper = (b.skin.labels == 1)[:, None]
    return _moved(b, 5, b.near("2.7", 0.3) * upper, (0.0, -s, 0.0))


def lip_into_teeth(b: Bench, s: float) -> AnimatableFace:
    return _moved(b, 1, b.near("2.3", 0.5), (0.0, 0.0, -s), select=2)


def lid_open(b: Bench, s: float) -> AnimatableFace:
    return spoilt(b, 20, lambda d, m: (1.0 - s) * d)


def lower_lid_back(b: Bench, s: float) -> AnimatableFace:
    return _moved(b, 22, b.near("3.4", 0.4), (0.0, 0.0, -s))


def eyeball_out(b: Bench, s: float) -> AnimatableFace:
    names = {x.name: x.mesh.vertex_count for x in b.face.scene.with_role(Role.EYE_RIGHT)}
    motions = []
    for motion in face_motions(b.face):
        if motion.fap_id == 22:
            forward = np.array([0.0, 0.0, s * _part(motion) * b.face.fapu.es0])
            motion = replace(
                motion, offsets={**motion.offsets, **{n: np.tile(forward, (k, 1)) for n, k in names.items()}}
            )
        motions.append(motion)
    return _built(b.face, motions)


def noise(b: Bench, s: float) -> AnimatableFace:
    shake = np.random.default_rng(7).normal(size=b.skin.surface.vertices.shape)
    return spoilt(b, 41, lambda d, m: d + s * np.linalg.norm(d, axis=1, keepdims=True) * shake)


def torn(b: Bench, s: float) -> AnimatableFace:
    places = b.skin.surface.positions
    inner = b.skin.surface.vertices[:, :1] > (places["4.2"][0] + places["4.4"][0]) / 2.0
    return spoilt(b, 34, lambda d, m: np.where(inner, (1.0 - s) * d, d))


def drift(b: Bench, s: float) -> AnimatableFace:
    z = b.skin.surface.vertices[:, 2:]
    behind = np.clip((b.skin.surface.positions["10.3"][2] - 0.1 - z) / 0.5, 0.0, 1.0)
    return _moved(b, 2, behind, (s, 0.0, 0.0))


def leak(b: Bench, s: float) -> AnimatableFace:
    other = {m.value: m for m in face_motions(b.face) if m.fap_id == 34}
    names, es0 = b.skin.surface.shapes, b.face.fapu.es0
    still = {n: np.zeros_like(b.face.scene.world_vertices(n)) for n in names}

    def leaked(d: Floats, m: FaceMotion) -> Floats:
        theirs = {**still, **other[m.value].offsets}
        added: Floats = d + s * np.concatenate([theirs[n] for n in names]) / es0
        return added

    return spoilt(b, 33, leaked)


def wrong_unit(b: Bench, s: float) -> AnimatableFace:
    return spoilt(b, 61, lambda d, m: (1.0 + s) * d)


def wrong_mouth_width(b: Bench, s: float) -> AnimatableFace:
    return replace(b.face, fapu=replace(b.face.fapu, mw0=(1.0 + s) * b.face.fapu.mw0))


def misplaced(b: Bench, s: float) -> AnimatableFace:
    """The outer left lip corner, moved outward by `s` eye widths."""
    places, skin = b.skin.surface.positions, b.skin.surface.vertices
    goal = places["8.3"] + [s * float(np.linalg.norm(places["3.7"] - places["3.11"])), 0.0, 0.0]
    away = np.where(b.skin.seen, np.linalg.norm(skin - goal, axis=1), np.inf)
    vertex = int(np.argmin(away))
    (name,) = b.skin.surface.shapes
    point = FeaturePoint(name, (vertex,), (1.0,))
    return replace(b.face, feature_points=FeaturePoints({**b.face.feature_points, "8.3": point}))


def stays_behind(b: Bench, s: float) -> AnimatableFace:
    keys = [k for k in b.skin.surface.positions if k not in NAMED and b.skin.surface.points.get(k)]
    stay = np.maximum.reduce([b.near(k, 0.15) for k in keys])
    return spoilt(b, None, lambda d, m: d * (1.0 - s * stay))


def lining_forward(b: Bench, s: float) -> AnimatableFace:
    lining = np.zeros((b.skin.surface.vertex_count, 1))
    lining[b.skin.lining] = 1.0
    return _moved(b, 1, lining, (0.0, 0.0, s), select=10)


def lining_left_behind(b: Bench, s: float) -> AnimatableFace:
    one = np.zeros((b.skin.surface.vertex_count, 1))
    one[b.skin.lining[0]] = 1.0
    return _moved(b, 18, one, (0.0, 0.0, -s))


def chin_mirrored(b: Bench, s: float) -> AnimatableFace:
    """1 presses the chin flat sideways, 2 turns it inside out."""
    side = b.skin.surface.vertices[:, :1] - b.skin.surface.positions["2.10"][0]
    return spoilt(b, 18, lambda d, m: d - s * min(_part(m), 1.0) * b.near("2.10", 0.3) * side * [1.0, 0.0, 0.0])


def one_nostril(b: Bench, s: float) -> AnimatableFace:
    own = b.near(fap(61).feature_points[0], 0.15)
    return spoilt(b, 61, lambda d, m: d * (1.0 + s * (1.0 - own)))


def wrinkles(b: Bench, s: float) -> AnimatableFace:
    wave = np.sin(2.0 * np.pi * b.skin.surface.vertices[:, :1] / 0.12)

    def wrinkled(d: Floats, m: FaceMotion) -> Floats:
        size = np.linalg.norm(d, axis=1, keepdims=True)
        added: Floats = d + s * _part(m) * wave * size / max(float(size.max()), 1e-12) * [0.0, 0.0, 1.0]
        return added

    return spoilt(b, 33, wrinkled)


def steeper(b: Bench, s: float) -> AnimatableFace:
    return spoilt(b, 6, lambda d, m: d * (1.0 - s + s * b.near("2.4", 0.15)))


def corner_aside(b: Bench, s: float) -> AnimatableFace:
    return spoilt(b, 59, lambda d, m: d + s * np.abs(d[:, 1:2]) * b.near("8.3", 0.3) * [1.0, 0.0, 0.0])


def nostrils_swapped(b: Bench, _: float) -> AnimatableFace:
    named = {61: 62, 62: 61}
    return _built(b.face, [replace(m, fap_id=named.get(m.fap_id or 0, m.fap_id)) for m in face_motions(b.face)])


_ES, _SHARE = "eye sep.", "of the motion"
_TENTH = tuple(x / 10.0 for x in LENGTHS)

DOSES: tuple[Dose, ...] = (
    Dose("lower lip's left pulled down in viseme kk", _ES, LENGTHS, "lip-gap", LIPS, lip_down),
    Dose(
        "upper lip's right pressed into the lower in FAP 5",
        _ES,
        LENGTHS,
        "lip-depth",
        ("teeth", *LIPS),
        lip_into_lip,
    ),
    Dose("lower lip pushed back in viseme FF", _ES, LENGTHS, "teeth", ("lining", "lip-depth", *LIPS), lip_into_teeth),
    Dose("right lid left open", _SHARE, SHARES, "lid-gap", ("held-out", *ONE_SIDED, *AMOUNT), lid_open),
    Dose("lower lid pushed back in FAP 22", _ES, LENGTHS, "lids", ("in-eyes", *ONE_SIDED, *SHAPE), lower_lid_back),
    Dose(
        "right eyeball pushed out in FAP 22",
        _ES,
        LENGTHS,
        "in-eyes",
        ("lids", "cross-talk", *ONE_SIDED, *AMOUNT),
        eyeball_out,
    ),
    Dose("noise in FAP 41", _SHARE, SHARES, "noise", ("hidden-stretch", *ONE_SIDED, *AMOUNT, *SHAPE), noise),
    Dose(
        "skin torn between the right brow's points in FAP 34",
        _SHARE,
        SHARES,
        "tear",
        (*ONE_SIDED, *AMOUNT, *SHAPE),
        torn,
    ),
    Dose("back of the head drifts in joy", _ES, _TENTH, "still", (), drift),
    Dose("FAP 34 leaks into FAP 33", _SHARE, SHARES, "cross-talk", ("held-out", *ONE_SIDED, *AMOUNT), leak),
    Dose("FAP 61 built with a FAPU too large", _SHARE, SHARES, "own-fp", (*ONE_SIDED, *AMOUNT), wrong_unit),
    Dose("MW0 of the tables too large", "of MW0", SHARES, "fapu", AMOUNT, wrong_mouth_width),
    Dose(
        "point 8.3 on the cheek",
        "eye widths",
        (0.1, 0.25, 0.5, 1.0),
        "points",
        ("cross-talk", "fapu", *AMOUNT),
        misplaced,
    ),
    Dose("points without a FAP stay behind", _SHARE, SHARES, "held-out", ("hidden-stretch", *SHAPE), stays_behind),
    Dose(
        "lining pushed forward in viseme aa",
        _ES,
        LENGTHS,
        "lining",
        ("hidden-stretch", "teeth", *SHAPE),
        lining_forward,
    ),
    Dose("a vertex of the lining left behind in FAP 18", _ES, LENGTHS, "hidden-stretch", (), lining_left_behind),
    Dose(
        "chin turned inside out in FAP 18",
        "(2 is all)",
        (0.5, 1.1, 1.5, 2.0),
        "flips-worst",
        ("held-out", *AMOUNT, *SHAPE),
        chin_mirrored,
    ),
    Dose(
        "FAP 61 moves more than FAP 62",
        _SHARE,
        SHARES,
        "symmetry",
        ("cross-talk", "held-out", *AMOUNT, *SHAPE),
        one_nostril,
    ),
    Dose("skin wrinkles in FAP 33", _ES, _TENTH, "bend", (*ONE_SIDED, *AMOUNT, *SHAPE), wrinkles),
    Dose(
        "FAP 6 ends too near its point",
        _SHARE,
        SHARES,
        "stretch99",
        ("held-out", "lip-gap", "lip-depth", *AMOUNT, *SHAPE),
        steeper,
    ),
    Dose(
        "lip corner goes aside in FAP 59",
        _SHARE,
        SHARES,
        "fp-error-worst",
        ("held-out", "cross-talk", "lip-gap", *AMOUNT, *SHAPE),
        corner_aside,
    ),
    Dose("FAPs 61 and 62 swapped", "", (1.0,), "own-fp", ("cross-talk", "held-out", *AMOUNT), nostrils_swapped),
)
