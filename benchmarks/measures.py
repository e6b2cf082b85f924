"""Which measure of ``fba check`` sees which fault: a good face spoilt in known ways, one fault at a time.

    python -m benchmarks.measures [--held-out] [--second] [--makehuman FOLDER] [--write]

The shipped source is cloned onto the smallest shipped head, and each spoilt copy is checked beside the good one. A
fault must fail its own measure, may fail those that by definition see the same, and must fail no other. --held-out
checks the faults of `benchmarks.held_out_faults` instead, --second those of `benchmarks.second_held_out`, whose head is
built from a MakeHuman folder. --write puts the tables into docs/checking.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cloning import clone
from fat.build import build_tables, face_motions
from fat.conformance import conformance
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.tables import FaceDefTable, FaceDefTables
from fba.arrays import Floats
from fba.faps import fap
from fba.feature_points import FeaturePoints
from fba.scene import Role
from formats import read_face, read_scene
from formats.landmarks import landmarks_beside, read_landmarks
from samples import sample
from samples.build.arkit_docs import put_tables
from studio.checked_skin import CheckedSkin, check_skin
from studio.fidelity import fidelity
from studio.judging import Measured, measure, verdicts
from studio.measures import MEASURES
from studio.verdicts import Verdict

if TYPE_CHECKING:
    from benchmarks.doses import Dose

DOCS = Path(__file__).resolve().parents[1] / "docs" / "checking.md"
MAKEHUMAN = Path(__file__).resolve().parents[2] / "shared" / "faces" / "makehuman"
HEAD = "faces/tri_head.obj"
FAPS = (3, 6, 7, 12, 19, 20, 31)
"""Enough to open the mouth, stretch and lift its corners, blink and raise a brow."""

SHAPE = ("tear", "stretch", "bend", "noise", "flips", "flips-worst", "fold")
"""All of these look at how smoothly neighbours move together."""
AMOUNT = ("own-fp", "fp-error", "fp-error-worst")
"""All of these look at the feature points that FAPs name."""
LIPS = ("lip-gap", "cross-talk", "held-out", *AMOUNT, *SHAPE)
"""What must see lips that go elsewhere, for the feature points there go with them."""


@dataclass(frozen=True)
class Bench:
    """The good face, its skin, and the source that it is read beside, with its measures and common points."""

    face: AnimatableFace
    skin: CheckedSkin
    source: AnimatableFace
    measured: Measured
    points: Collection[str]

    def check(self, spoilt: AnimatableFace) -> dict[str, Verdict]:
        """Every measure of a spoilt copy, beside the good face."""
        return {v.code: v for v in verdicts(self._measure(spoilt), self.measured, fidelity(spoilt, self.source))}

    def _measure(self, spoilt: AnimatableFace) -> Measured:
        """Measure a copy; where only motions are spoilt, only these and those of the other side."""
        good = self.face
        if spoilt.feature_points is not good.feature_points or spoilt.fapu is not good.fapu:
            return measure(spoilt, 0.0, conformance(spoilt), self.skin, self.points)
        changed = {t.key for t in spoilt.tables if not _alike(t, self._rebuilt.tables.get(*t.key))}
        changed |= {(fap(n).mirror or n, select) for n, select in changed}
        some = replace(spoilt, tables=FaceDefTables(tuple(t for t in spoilt.tables if t.key in changed)))
        new = measure(some, 0.0, conformance(some), self.skin, self.points)
        known = self._good
        own = {f.fap_id: f for f in known.own} | {f.fap_id: f for f in new.own}
        rows = {r.key: r for r in known.rows} | {r.key: r for r in new.rows}
        motions = {m.key: m for m in known.motions} | {m.key: m for m in new.motions}
        return Measured(spoilt, 0.0, tuple(own.values()), tuple(rows.values()), tuple(motions.values()))

    @cached_property
    def _rebuilt(self) -> AnimatableFace:
        """The good face with tables built as a spoilt copy's are, which rounds them."""
        transforms = {t.key: t.transforms for t in self.face.tables}
        tables = build_tables(self.face.scene, self.face.fapu, face_motions(self.face), transforms)
        return replace(self.face, tables=tables)

    @cached_property
    def _good(self) -> Measured:
        return measure(self.face, 0.0, conformance(self.face), self.skin, self.points)

    def near(self, point: str, reach: float) -> Floats:
        """(n, 1) weights of the skin around a feature point: 1 there, smoothly 0 at a reach in eye separations."""
        away = self.skin.surface.distances([point], reach)[0]
        part = np.clip(1.0 - away / reach, 0.0, 1.0)
        weight: Floats = (part * part * (3.0 - 2.0 * part))[:, None]
        return weight


def _alike(one: FaceDefTable, other: FaceDefTable | None) -> bool:
    """Whether two tables move everything alike."""
    if other is None or one.transforms != other.transforms:
        return False
    mine, theirs = ({m.shape: m for m in table.meshes} for table in (one, other))
    return mine.keys() == theirs.keys() and all(
        np.array_equal(m.coord_index, theirs[name].coord_index)
        and np.array_equal(m.interval_borders, theirs[name].interval_borders)
        and np.array_equal(m.displacements, theirs[name].displacements)
        for name, m in mine.items()
    )


@dataclass(frozen=True)
class Fault:
    """A way to spoil a face.

    Attributes
    ----------
    its : the measure that must fail.
    kin : measures that may fail with it, as they see the same places by definition.
    """

    name: str
    its: str
    kin: tuple[str, ...]
    spoil: Callable[[Bench], AnimatableFace]


def bench() -> Bench:
    """The good face, which is its own source."""
    face, skin = good_clone(HEAD, read_face("default"), FAPS)
    return Bench(face, skin, face, measure(face, 0.0, conformance(face), skin), skin.surface.points)


def good_clone(
    head: str, source: AnimatableFace, faps: Collection[int] | None = None
) -> tuple[AnimatableFace, CheckedSkin]:
    """A clone of a source on a shipped head, and its skin."""
    path = sample(head)
    scene = read_scene(path)
    beside = landmarks_beside(path)
    points = None if beside is None else read_landmarks(beside, scene)
    face = clone(source, scene, points, faps=faps)
    skin = check_skin(face)
    assert skin is not None
    return face, skin


def edited(bench: Bench, faps: tuple[int, ...], change: Callable[[Floats, FaceMotion], Floats]) -> AnimatableFace:
    """The good face with the skin's offsets (n, 3), in eye separations, of some FAPs changed."""
    face, es0 = bench.face, bench.face.fapu.es0
    surface = bench.skin.surface
    motions = []
    for motion in face_motions(face):
        if motion.fap_id in faps:
            still = {n: np.zeros_like(face.scene.world_vertices(n)) for n in surface.shapes}
            joined = np.concatenate([{**still, **motion.offsets}[n] for n in surface.shapes]) / es0
            skin = surface.split(es0 * change(joined, motion))
            motion = replace(motion, offsets={**motion.offsets, **skin})
        motions.append(motion)
    transforms = {t.key: t.transforms for t in face.tables}
    return replace(face, tables=build_tables(face.scene, face.fapu, motions, transforms))


def lips_pulled(b: Bench) -> AnimatableFace:
    down = b.near("2.3", 0.3) * [0.0, -0.1 * b.face.fapu.mns0 / b.face.fapu.es0, 0.0]
    return edited(b, (12,), lambda d, m: d + down)


def lips_into_teeth(b: Bench) -> AnimatableFace:
    back = np.maximum(b.near("2.2", 0.6), b.near("2.3", 0.6)) * [0.0, 0.0, -0.2]
    return edited(b, (31,), lambda d, m: d + back)


def lips_into_each_other(b: Bench) -> AnimatableFace:
    lower = (b.skin.labels == 2)[:, None]
    up = b.near("2.3", 0.4) * lower * [0.0, 0.4 * b.face.fapu.mns0 / b.face.fapu.es0, 0.0]
    return edited(b, (12,), lambda d, m: d + up)


def lid_open(b: Bench) -> AnimatableFace:
    return edited(b, (19,), lambda d, m: 0.8 * d)


def noise(b: Bench) -> AnimatableFace:
    rng = np.random.default_rng(0)
    shake = rng.normal(size=b.skin.surface.vertices.shape)

    def shaken(d: Floats, m: FaceMotion) -> Floats:
        size = np.linalg.norm(d, axis=1, keepdims=True)
        added: Floats = d + 0.2 * size * shake * _unpointed(b)
        return added

    return edited(b, (3,), shaken)


def _unpointed(b: Bench) -> Floats:
    """(n, 1) 0 on lips and lids and at the vertices of feature points, 1 elsewhere."""
    free = (b.skin.labels == 0).astype(np.float64)[:, None]
    for vertices, _ in b.skin.surface.points.values():
        free[vertices] = 0.0
    return free


def drift(b: Bench) -> AnimatableFace:
    z = b.skin.surface.vertices[:, 2:]
    behind = np.clip((b.skin.surface.positions["10.3"][2] - 0.1 - z) / 0.5, 0.0, 1.0)
    return edited(b, (31,), lambda d, m: d + 0.01 * behind * [0.0, 1.0, 0.0])


def swapped(b: Bench) -> AnimatableFace:
    face = b.face
    named = {6: 7, 7: 6}
    motions = [replace(m, fap_id=named.get(m.fap_id or 0, m.fap_id)) for m in face_motions(face)]
    transforms = {t.key: t.transforms for t in face.tables}
    return replace(face, tables=build_tables(face.scene, face.fapu, motions, transforms))


def scaled_fapu(b: Bench) -> AnimatableFace:
    return replace(b.face, fapu=replace(b.face.fapu, ens0=1.1 * b.face.fapu.ens0))


def wrong_unit(b: Bench) -> AnimatableFace:
    return edited(b, (31,), lambda d, m: 1.1 * d)


def torn(b: Bench) -> AnimatableFace:
    surface = b.skin.surface
    beyond = surface.vertices[:, 0] > surface.positions["2.3"][0] + 0.06
    low = surface.vertices[:, 1] < surface.positions["2.3"][1] - 0.04
    return edited(b, (3,), lambda d, m: np.where((beyond & low)[:, None], 0.6 * d, d))


def through_lid(b: Bench) -> AnimatableFace:
    back = b.near("3.1", 0.4) * [0.0, 0.0, -0.1]
    return edited(b, (19,), lambda d, m: d + back)


def misplaced_point(b: Bench) -> AnimatableFace:
    points = b.face.feature_points
    return replace(b.face, feature_points=FeaturePoints({**points, "4.5": points["3.11"]}))


def held_out(b: Bench) -> AnimatableFace:
    bump = sum(b.near(key, 0.15) for key in ("2.11", "2.12", "9.12"))
    return edited(b, FAPS, lambda d, m: d + 0.6 * float(np.abs(d).max()) * bump * [0.0, 0.0, 1.0])


def eyeball_forward(b: Bench) -> AnimatableFace:
    names = {s.name for s in b.face.scene.with_role(Role.EYE_LEFT)}
    forward = np.array([0.0, 0.0, 0.08 * b.face.fapu.es0])
    motions = [
        replace(
            m,
            offsets={**m.offsets, **{n: np.tile(forward, (b.face.scene.shape(n).mesh.vertex_count, 1)) for n in names}},
        )
        if m.fap_id == 19
        else m
        for m in face_motions(b.face)
    ]
    transforms = {t.key: t.transforms for t in b.face.tables}
    return replace(b.face, tables=build_tables(b.face.scene, b.face.fapu, motions, transforms))


FAULTS: tuple[Fault, ...] = (
    Fault("nothing", "", (), lambda b: b.face),
    Fault("lips pulled apart in FAP 12", "lip-gap", ("cross-talk", *AMOUNT), lips_pulled),
    Fault(
        "lower lip pressed into the upper in FAP 12",
        "lip-depth",
        ("lip-gap", "teeth", "cross-talk", *AMOUNT, *SHAPE),
        lips_into_each_other,
    ),
    Fault("lips pushed back in FAP 31", "teeth", ("lining", *LIPS), lips_into_teeth),
    Fault("lid left open by a fifth", "lid-gap", AMOUNT, lid_open),
    Fault("lid pushed back in FAP 19", "lids", ("in-eyes", *SHAPE), through_lid),
    Fault("eyeball pushed through the lid in FAP 19", "in-eyes", ("lids", "cross-talk", *AMOUNT), eyeball_forward),
    Fault("noise of a fifth of the motion in FAP 3", "noise", SHAPE, noise),
    Fault("skin torn in FAP 3", "tear", ("stretch", "bend"), torn),
    Fault("back of the head drifts in FAP 31", "still", (), drift),
    Fault("FAPs 6 and 7 swapped", "own-fp", ("cross-talk", "held-out", *AMOUNT), swapped),
    Fault("FAP 31 built with a FAPU a tenth too large", "own-fp", AMOUNT, wrong_unit),
    Fault("ENS0 of the tables a tenth too large", "fapu", (), scaled_fapu),
    Fault("feature point 4.5 at the eye's corner", "points", ("point-sides", "cross-talk", *AMOUNT), misplaced_point),
    Fault("points without a FAP bulge in every motion", "held-out", ("hidden-stretch", *SHAPE), held_out),
)


def matrix(b: Bench) -> dict[str, dict[str, Verdict]]:
    """Fault -> measure -> verdict."""
    return {fault.name: b.check(fault.spoil(b)) for fault in FAULTS}


def unseen_and_unrelated(found: dict[str, dict[str, Verdict]]) -> list[str]:
    """What is not as it should be: faults that their measure passes, and measures that fail for another's fault."""
    wrong = []
    for fault in FAULTS:
        failed = {code for code, v in found[fault.name].items() if v.failed}
        if fault.its and fault.its not in failed:
            wrong.append(f"{fault.name}: {fault.its} does not see it")
        wrong += [f"{fault.name}: {code} fails" for code in sorted(failed - {fault.its, *fault.kin})]
    return wrong


def lines(found: dict[str, dict[str, Verdict]]) -> list[str]:
    """The faults as a Markdown table."""
    out = ["| fault | its measure | good face | spoilt | fails above | also fails |", "|---|---|---|---|---|---|"]
    for fault in FAULTS[1:]:
        mine = found[fault.name][fault.its]
        good = found["nothing"][fault.its].value if mine.source is None else mine.source
        others = ", ".join(c for c, v in found[fault.name].items() if v.failed and c != fault.its)
        limit = "" if mine.limit is None else f"{mine.limit:.3g}"
        out.append(f"| {fault.name} | {fault.its} | {good:.3g} | **{mine.value:.3g}** | {limit} | {others} |")
    return out


def measure_lines() -> list[str]:
    """All measures as a Markdown table."""
    rules = {"limit": "", "beyond": "source's + ", "times": "source's x "}
    out = [
        "| code | what | unit | good | fails above | must | where the limits come from |",
        "|---|---|---|---|---|---|---|",
    ]
    for m in MEASURES:
        good, fail = (f"{rules[m.rule]}{v:g}" for v in (m.good, m.fail))
        out.append(f"| {m.code} | {m.what} | {m.unit} | {good} | {fail} | {'yes' if m.must else ''} | {m.origin} |")
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--second", action="store_true")
    parser.add_argument("--makehuman", type=Path, default=MAKEHUMAN)
    options = parser.parse_args()
    tables = _held_out() if options.held_out else _second(options.makehuman) if options.second else _known()
    if options.write:
        put_tables(DOCS, {name: "\n".join(rows) + "\n" for name, rows in tables.items()})


def _known() -> dict[str, list[str]]:
    found = matrix(bench())
    table = lines(found)
    print(*table, sep="\n")
    print("\n".join(unseen_and_unrelated(found)) or "every fault is seen by its measure, and by no unrelated one")
    return {"measures": measure_lines(), "faults": table}


def _held_out() -> dict[str, list[str]]:
    from benchmarks.held_out_faults import DOSES, held_out_bench

    return {"held-out": _dosed(held_out_bench(), DOSES)}


def _second(makehuman: Path) -> dict[str, list[str]]:
    from benchmarks.second_held_out import DOSES, second_bench

    return {"second held-out": _dosed(second_bench(makehuman), DOSES)}


def _dosed(b: Bench, doses: Sequence[Dose]) -> list[str]:
    from benchmarks.held_out_table import dose_lines, outcomes, summary

    found = outcomes(b, doses)
    table = [*dose_lines(doses, found), "", summary(doses, found)]
    print(*table, sep="\n")
    return table


if __name__ == "__main__":
    main()
