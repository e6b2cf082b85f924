"""Is an animatable face good? Conformance by itself, fidelity beside the source it was cloned from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fat.build import face_motions
from fat.conformance import FapConformance, conformance
from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality
from fat.motion import FaceMotion
from fat.quality import fap_error, fap_values, feature_point_motion, flips, lid_gap, lip_gap_change
from fat.validate import validate
from fba.amplitudes import amplitudes
from fba.arrays import Floats
from fba.faps import EXPRESSION_FAP, LOW_LEVEL_FAPS, VISEME_FAP
from fba.findings import Finding
from fba.high_level import BLEND_MAX
from fba.scene import Role
from studio.fap_measuring import measure_faps

FP_ERROR_MUST = 0.01
"""Largest mean relative error over all feature points of a motion."""
LIP_GAP_MUST = 0.01
"""MNS; largest change of the lips' opening against the source."""
LID_GAP_MUST = 0.05
"""IRISD; how much wider than the source's an eye may stay open after a blink."""
FLIPS_MUST = 0.3
"""Percent of moving triangles beyond the source's, mean over all motions at their normal amplitudes."""
BLINK = {19: 1024.0, 20: 1024.0}


@dataclass(frozen=True, slots=True)
class Fidelity:
    """A clone beside its source; means and worst values over the motions that both have.

    fp_error : relative error over all feature points and FAP axes (0.01 = 1 %).
    unasked : motions whose feature points stay still on the source, but not on the clone.
    lip_gap : largest change of the lips' opening in MNS.
    lid_gap : how much wider the worse eye stays open after a blink, in IRISD; None without eyelid FAPs.
    flips : percent of moving skin triangles turned by more than 90 degrees.
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

    def failures(self) -> list[Finding]:
        """Everything beyond the limits above."""
        rows = [
            ("fp-error", self.fp_error_mean, FP_ERROR_MUST, "mean feature point error beside the source"),
            ("lip-gap", self.lip_gap, LIP_GAP_MUST, f"lips open differently in {self.lip_gap_motion}, MNS"),
            ("lid-gap", self.lid_gap or 0.0, LID_GAP_MUST, "eyes stay open after a blink, IRISD beyond the source"),
            ("flips", self.flips_mean - self.source_flips_mean, FLIPS_MUST, "% of triangles flip beyond the source's"),
        ]
        findings = [
            Finding("error", code, f"{text}: {value:.3g}, at most {limit:g}")
            for code, value, limit, text in rows
            if value > limit
        ]
        return findings + [
            Finding("error", "unasked", "feature points move that are still on the source", name)
            for name in self.unasked
        ]


@dataclass(frozen=True, eq=False)
class CheckResult:
    """What `fba check` prints.

    unmeasured : low-level FAPs with a table, but without a feature point to measure them at.
    quality : the measures of each FAP (both directions), viseme and expression.
    source_quality : the same rows of the source, where it has them. A face that is checked by itself must keep every
        limit; a clone inherits its source's flaws, so beside a source only what is worse there is told, as warnings.
    """

    findings: tuple[Finding, ...]
    neutral_unchanged: bool
    faps: tuple[FapConformance, ...]
    unmeasured: tuple[str, ...]
    fidelity: Fidelity | None
    quality: tuple[FapQuality, ...] = ()
    source_quality: tuple[FapQuality, ...] | None = None

    @cached_property
    def remarks(self) -> tuple[Finding, ...]:
        """What is worth telling about the motions, but no reason to fail."""
        out = []
        for row, beside in self.compared:
            out += row.remarks()
            out += [] if beside is None else row.failures(beside)
        return tuple(out)

    @cached_property
    def compared(self) -> tuple[tuple[FapQuality, FapQuality | None], ...]:
        """Each row and the source's."""
        theirs = {row.key: row for row in self.source_quality or ()}
        return tuple((row, theirs.get(row.key)) for row in self.quality)

    @cached_property
    def problems(self) -> tuple[Finding, ...]:
        """Every reason why the face fails, on top of `findings`."""
        out = []
        if not self.neutral_unchanged:
            out.append(Finding("error", "neutral", "the neutral face moves although every FAP is 0"))
        for fap in self.faps:
            if not fap.passed:
                text = f"{fap.name} at {fap.value} moves its feature point {fap.point} by {fap.found:.1f} FAP units"
                out.append(Finding("error", "own-fp", text, f"FAP {fap.fap_id}"))
        for row, beside in self.compared:
            out += row.failures() if beside is None else []
        return (*out, *(self.fidelity.failures() if self.fidelity else ()))

    @property
    def passed(self) -> bool:
        return not self.problems and all(f.severity != "error" for f in self.findings)

    def to_dict(self) -> dict[str, object]:
        """Everything as plain data."""
        return {
            "passed": self.passed,
            "neutral_unchanged": self.neutral_unchanged,
            "findings": [asdict(f) for f in (*self.problems, *self.remarks, *self.findings)],
            "faps": [{**asdict(f), "relative_error": f.relative_error, "passed": f.passed} for f in self.faps],
            "unmeasured": list(self.unmeasured),
            "quality": [row.to_dict() for row in self.quality],
            "source_quality": None if self.source_quality is None else [row.to_dict() for row in self.source_quality],
            "fidelity": asdict(self.fidelity) if self.fidelity else None,
        }


def check_file(path: Path) -> list[Finding]:
    """What is wrong with the file itself; USD files go through OpenUSD's validators and our own."""
    if path.suffix.lower() not in (".usd", ".usda", ".usdc"):
        return []
    from formats.usd.validate import validate_stage

    return validate_stage(path)


def check_face(
    face: AnimatableFace, source: AnimatableFace | None = None, file_findings: Iterable[Finding] = ()
) -> CheckResult:
    """Check a face; tables that cannot be played are reported, not measured."""
    findings = (*file_findings, *validate(face))
    if any(f.severity == "error" for f in findings):
        return CheckResult(findings, True, (), (), None)
    neutral = Player(face).pose().local
    unchanged = all(neutral[s.name].tobytes() == s.mesh.vertices.tobytes() for s in face.scene.shapes)
    measured = tuple(conformance(face))
    seen = {fap.fap_id for fap in measured}
    unmeasured = tuple(t.name for t in face.tables if t.fap_id in LOW_LEVEL_FAPS and t.fap_id not in seen)
    return CheckResult(
        findings,
        unchanged,
        measured,
        unmeasured,
        None if source is None else fidelity(face, source),
        tuple(measure_faps(face)),
        None if source is None else tuple(measure_faps(source)),
    )


def fidelity(face: AnimatableFace, source: AnimatableFace) -> Fidelity | None:
    """Compare every motion that both faces have; None if there is none."""
    mine = {(m.fap_id, m.select, m.value): m for m in face_motions(face)}
    theirs = {(m.fap_id, m.select, m.value): m for m in face_motions(source)}
    common = [key for key in theirs if key in mine]
    if not common:
        return None
    errors, lips = {}, {}
    for key in common:
        a, b = _points(source, theirs[key]), _points(face, mine[key])
        name = f"{theirs[key].name} at {theirs[key].value}"
        errors[name] = fap_error(fap_values(a, source.fapu), fap_values(b, face.fapu)).relative
        lips[name] = lip_gap_change(a, source.fapu, b, face.fapu)
    finite = {k: v for k, v in errors.items() if np.isfinite(v)}
    worst = max(finite, key=lambda k: finite[k], default="")
    lip = max(lips, key=lambda k: lips[k])
    return Fidelity(
        len(common),
        tuple(name for name in errors if name not in finite),
        float(np.mean(list(finite.values()))) if finite else 0.0,
        finite.get(worst, 0.0),
        worst,
        lips[lip],
        lip,
        _lid_gap_beyond(face, source),
        _flips(face, source),
        _flips(source, face),
    )


def _points(face: AnimatableFace, motion: FaceMotion) -> dict[str, Floats]:
    return feature_point_motion(face.feature_points, motion.offsets)


def _flips(face: AnimatableFace, other: AnimatableFace) -> float:
    """Mean share of flipped triangles, in percent, at the normal amplitudes of all motions that both faces have."""
    keys = {t.key for t in face.tables if t.meshes} & {t.key for t in other.tables if t.meshes}
    skins = [(s.name, face.scene.world_vertices(s.name), s.mesh.triangles) for s in face.scene.with_role(Role.SKIN)]
    player = Player(face)
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


def _lid_gap_beyond(face: AnimatableFace, source: AnimatableFace) -> float | None:
    gaps: list[Mapping[str, float]] = []
    for one in (source, face):
        if any(one.tables.get(number) is None for number in BLINK):
            return None
        rest = one.feature_points.positions(one.scene)
        moved = one.feature_points.positions(one.scene, Player(one).pose(BLINK).world_shapes())
        gaps.append(lid_gap(rest, {k: moved[k] - rest[k] for k in rest}, one.fapu))
    common = gaps[0].keys() & gaps[1].keys()
    return max((gaps[1][k] - gaps[0][k] for k in common), default=None)
