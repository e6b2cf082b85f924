"""Is an animatable face good? Conformance by itself, fidelity beside the source it was cloned from."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fat.conformance import FapConformance, conformance
from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.fap_quality import FapQuality
from fat.validate import validate
from fba.faps import LOW_LEVEL_FAPS
from fba.findings import Finding
from studio.checked_skin import CheckedSkin, check_skin, common_points
from studio.fidelity import Fidelity, fidelity
from studio.judging import Measured, measure, verdicts
from studio.truth import beside_truth, require_same_mesh
from studio.verdicts import Verdict

TOLD_BY_FAP = ("own-fp", "cross-talk", "in-eyes", "seams", "lining", "hidden-stretch", "flips-worst")
"""Measures whose failures are told FAP by FAP, in findings of their own."""


@dataclass(frozen=True, eq=False)
class CheckResult:
    """What `fba check` prints.

    unmeasured : low-level FAPs with a table, but without a feature point to measure them at.
    quality : the measures of each FAP (both directions), viseme and expression.
    verdicts : every measure at its worst place, beside the source's, see `studio.measures`.
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
    verdicts: tuple[Verdict, ...] = ()

    @cached_property
    def remarks(self) -> tuple[Finding, ...]:
        """What is worth telling about the motions, but no reason to fail."""
        out = []
        for row, beside in self.compared:
            out += row.remarks(beside)
            out += [] if beside is None else row.failures(beside)
        told = [v.finding() for v in self.verdicts if v.failed and not v.measure.must and v.code not in TOLD_BY_FAP]
        return (*out, *told)

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
        told = {"neutral", "own-fp"} | ({"cross-talk"} if self.source_quality is None else set())
        return (*out, *(v.finding() for v in self.verdicts if v.failed and v.measure.must and v.code not in told))

    @property
    def passed(self) -> bool:
        return not self.problems and all(f.severity != "error" for f in self.findings)

    def to_dict(self) -> dict[str, object]:
        """Everything as plain data."""
        return {
            "passed": self.passed,
            "neutral_unchanged": self.neutral_unchanged,
            "findings": [asdict(f) for f in (*self.problems, *self.remarks, *self.findings)],
            "measures": [v.to_dict() for v in self.verdicts],
            "faps": [{**asdict(f), "relative_error": f.relative_error, "passed": f.passed} for f in self.faps],
            "unmeasured": list(self.unmeasured),
            "quality": [row.to_dict() for row in self.quality],
            "source_quality": None if self.source_quality is None else [row.to_dict() for row in self.source_quality],
            "fidelity": asdict(self.fidelity) if self.fidelity else None,
        }


def check_file(path: Path) -> list[Finding]:
    """What is wrong with the file itself; USD files go through OpenUSD's validators and our own."""
    if path.suffix.lower() not in (".usd", ".usda", ".usdc", ".usdz"):
        return []
    from formats.usd.validate import validate_stage

    return validate_stage(path)


def check_face(
    face: AnimatableFace,
    source: AnimatableFace | None = None,
    file_findings: Iterable[Finding] = (),
    truth: AnimatableFace | None = None,
) -> CheckResult:
    """Check a face; tables that cannot be played are reported, not measured.

    Parameters
    ----------
    source : the face it was cloned from.
    truth : the same mesh, moved as it should be.

    Raises
    ------
    MeshError
        If the truth has another mesh.
    """
    if truth is not None:
        require_same_mesh(face, truth)
    findings = (*file_findings, *validate(face))
    if any(f.severity == "error" for f in findings):
        return CheckResult(findings, True, (), (), None)
    skin = check_skin(face)
    if source is None or source is face:
        mine = _measured(face, skin)
        theirs = mine if source is face else None
    else:
        alike = source.scene is face.scene and source.feature_points is face.feature_points
        other = skin if alike else check_skin(source)
        points = common_points(skin, other)
        mine, theirs = _measured(face, skin, points), _measured(source, other, points)
    beside = None if source is None else fidelity(face, source)
    true = [] if truth is None or skin is None else beside_truth(face, truth, skin)
    seen = {fap.fap_id for fap in mine.own}
    unmeasured = tuple(t.name for t in face.tables if t.fap_id in LOW_LEVEL_FAPS and t.fap_id not in seen)
    return CheckResult(
        findings,
        mine.neutral == 0.0,
        mine.own,
        unmeasured,
        beside,
        mine.rows,
        None if theirs is None else theirs.rows,
        (*verdicts(mine, theirs, beside), *true),
    )


def _measured(face: AnimatableFace, skin: CheckedSkin | None, points: Collection[str] | None = None) -> Measured:
    neutral = Player(face).pose().local
    off = [float(np.abs(neutral[s.name] - s.mesh.vertices).max(initial=0.0)) for s in face.scene.shapes]
    return measure(face, max(off, default=0.0) / face.fapu.es0, conformance(face), skin, points)
