"""How good the motion of one FAP is, in numbers with limits.

Measured at a normal, well visible amplitude (`fba.amplitudes`) and as far as the table goes, in each direction of the
FAP. Visemes and expressions are measured at 63, which is as far as they go.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fat.conformance import FapConformance
from fat.quality import cross_talk, fap_values
from fba.arrays import Bools, Floats, Ints
from fba.faps import EXPRESSION_FAP, Fap, fap, faps
from fba.fapu import Fapu
from fba.findings import Finding, Severity

CROSS_TALK_MUST = 0.05
"""Share of a FAP's own motion that another, independent FAP's feature point may make."""

FLIPS_MUST = 0.5
"""Percent of the moving triangles that may turn over where the table ends; none at the normal amplitude."""

STRETCH_MUST = 5.0
"""Largest stretch of an edge in skin that is hidden at rest. Measured on the shapes of ICT-FaceKit: 4.2 for a jaw
opened as far as it goes, at most 2.1 for all others. An edge that gets longer still has one end left behind."""

SLACK = 0.01
"""Eye separations (0.6 mm) added to both lengths of an edge, so that the tiny edges of a mesh do not count."""

APART = 1e-4
"""Eye separations by which the copies of a vertex along a seam may come apart."""

DEPTH = 0.02
"""Radii of the eyeball by which skin may get deeper into it than it is at rest."""

PENETRATION_MUST = 0.2
"""Percent of the skin vertices on the front of an eyeball that may get into it."""

MARGIN = 0.1
"""Parts of a limit by which a clone's measure must exceed the source's to be told."""

ASYMMETRY_MAY = 0.01
"""Relative L2 difference of the two sides from which it is worth telling; a modelled face may want it."""


@dataclass(frozen=True, slots=True)
class FapQuality:
    """The measures of one FAP in one direction, of one viseme or of one expression; None where not measurable.

    Attributes
    ----------
    value : the normal amplitude, at which everything but `flips_at_limit` and `own` is measured.
    limit : how far the table goes in this direction, at least `value`.
    own : the FAP's own feature point where it is farthest off.
    cross_talk : largest motion of another FAP's feature point as a share of the own, and whose.
    flips, flips_at_limit : percent of the moving skin triangles whose normal turns by more than 90 degrees.
    stretch : largest stretch of an edge of hidden skin.
    parted : seam vertices whose copies come apart, at the limit too.
    penetration : percent of the skin vertices on the front of the eyeballs that get into them.
    asymmetry : relative L2 difference from the mirror image of the other side's FAP.
    through : vertices of the lining of mouth, cheeks and nose that come before the skin.
    fold : size in eye separations of the largest patch that is seen at rest and turns over, see `fat.folds`.
    """

    fap_id: int
    select: int
    name: str
    value: int
    limit: int
    own: FapConformance | None
    cross_talk: float | None
    cross_fap: int | None
    flips: float | None
    flips_at_limit: float | None
    stretch: float | None
    parted: int | None
    penetration: float | None
    asymmetry: float | None
    through: int | None = None
    fold: float | None = None

    @property
    def high_level(self) -> bool:
        """A viseme or an expression."""
        return self.fap_id <= EXPRESSION_FAP

    @property
    def key(self) -> tuple[int, int, bool]:
        """What tells this row from all others of a face: FAP, select, and whether the value is positive."""
        return self.fap_id, self.select, self.value > 0

    @property
    def severity(self) -> float:
        """The worst measure in parts of its limit: above 1 something fails."""
        own = 0.0 if self.own is None or self.own.passed else 1.0 + self.own.relative_error
        return max((share for *_, share in self._shares()), default=0.0) + own

    @property
    def passed(self) -> bool:
        """Everything within the limits, the own motion too."""
        return not self.failures() and (self.own is None or self.own.passed)

    def failures(self, beside: FapQuality | None = None) -> list[Finding]:
        """What is beyond its limit; the own motion is a matter of conformance and not among it.

        Parameters
        ----------
        beside : the same row of the face that this one was cloned from: only what is clearly worse than there is told.
        """
        theirs = {} if beside is None else {code: share for code, _, share in beside._shares()}
        severity: Severity = "error" if beside is None else "warning"
        return [
            Finding(severity, code, text, self.where)
            for code, text, share in self._shares()
            if share > max(1.0, theirs.get(code, 0.0) + MARGIN * (beside is not None))
        ]

    @property
    def where(self) -> str:
        """The row's name for messages."""
        return self.name if self.high_level else f"{self.name} at {self.value:+d}"

    def remarks(self, beside: FapQuality | None = None) -> list[Finding]:
        """Differences between the two sides of a symmetric face; beside another's row, clearly larger ones."""
        theirs = 0.0 if beside is None else beside.asymmetry or 0.0
        if self.high_level or self.asymmetry is None or self.asymmetry <= max(ASYMMETRY_MAY, theirs * (1.0 + MARGIN)):
            return []
        text = f"differs from its mirror image by {100 * self.asymmetry:.1f} %"
        return [Finding("warning", "fap-asymmetry", text, self.where)]

    def to_dict(self) -> dict[str, object]:
        """Everything as plain data."""
        fields = {name: getattr(self, name) for name in self.__slots__ if name != "own"}
        own = None if self.own is None else self.own.relative_error
        return {**fields, "own_error": own, "passed": self.passed}

    def _shares(self) -> Iterator[tuple[str, str, float]]:
        """Code, message, and the measure in parts of its limit."""
        if self.cross_talk is not None and self.cross_fap is not None:
            other = fap(self.cross_fap).name
            text = f"moves the feature point of {other} by {100 * self.cross_talk:.1f} % of its own, at most 5 %"
            yield "fap-cross-talk", text, self.cross_talk / CROSS_TALK_MUST
        if self.flips is not None and not self.high_level:
            text = f"{self.flips:.2f} % of the moving triangles turn over at a normal amplitude, at most 0"
            yield "fap-flips", text, 1.0 + self.flips if self.flips > 0.0 else 0.0
        if self.flips_at_limit is not None:
            text = (
                f"{self.flips_at_limit:.2f} % of the moving triangles turn over at {self.limit}, at most {FLIPS_MUST}"
            )
            yield "fap-flips-at-limit", text, self.flips_at_limit / FLIPS_MUST
        if self.stretch is not None:
            text = f"an edge of hidden skin gets {self.stretch:.1f} times as long, at most {STRETCH_MUST:g}"
            yield "fap-tear", text, self.stretch / STRETCH_MUST
        if self.parted is not None:
            text = f"vertices that come apart along a seam: {self.parted}"
            yield "fap-seam", text, 1.0 + self.parted if self.parted else 0.0
        if self.through is not None:
            text = f"vertices of the lining that come through the skin before it: {self.through}"
            yield "fap-lining", text, 1.0 + self.through if self.through else 0.0
        if self.penetration is not None:
            text = (
                f"{self.penetration:.2f} % of the skin before the eyeballs gets into them, at most {PENETRATION_MUST}"
            )
            yield "fap-penetration", text, self.penetration / PENETRATION_MUST


def mirrored(fap_id: int, value: int) -> tuple[int, int]:
    """The FAP and value that show the mirror image of a FAP's motion on a symmetric face.

    >>> mirrored(6, 150), mirrored(15, 100), mirrored(23, 30000), mirrored(48, 30000)
    ((7, 150), (15, -100), (24, -30000), (48, 30000))
    """
    own = fap(fap_id)
    other = own if own.mirror is None else fap(own.mirror)
    same = 0.0
    if own.direction is not None and other.direction is not None:
        same = float(np.dot(np.multiply(own.direction, (-1.0, 1.0, 1.0)), other.direction))
    elif own.rotation_axis is not None and other.rotation_axis is not None:
        same = float(np.dot(np.multiply(own.rotation_axis, (1.0, -1.0, -1.0)), other.rotation_axis))
    return other.id, -value if same < 0.0 else value


def independent_motion(
    definition: Fap, motion: Mapping[str, Floats], fapu: Fapu, largest: float
) -> tuple[float | None, int | None]:
    """Cross-talk of a FAP, and the other FAP.

    Parameters
    ----------
    motion : feature point -> offset (3,); see `fat.quality.feature_point_motion`.
    largest : the largest offset of any vertex in this motion, mesh units. FAPs without a direction, or whose own
        point is not there, are compared with it.

    Returns
    -------
    None, None for what carries everything along: visemes, expressions, the head.
    """
    if definition.id <= EXPRESSION_FAP or definition.feature_points[0].startswith("7.") or not largest > 0.0:
        return None, None
    values = fap_values(motion, fapu)
    if definition.id not in values:
        units = {f.id: fapu.unit(f.unit) for f in faps()}
        values = {k: v * units[k] / largest for k, v in values.items()} | {definition.id: 1.0}
    return cross_talk(values, definition.id)


def stretch(vertices: Floats, edges: Ints, offsets: Floats) -> float:
    """Largest length of an edge after a motion in parts of the length before, SLACK added to both.

    Parameters
    ----------
    vertices, offsets : (n, 3) in eye separations. edges : (e, 2).
    """
    a, b = edges.T
    way = vertices[b] - vertices[a]
    before = np.linalg.norm(way, axis=1)
    after = np.linalg.norm(way + offsets[b] - offsets[a], axis=1)
    return float(np.max((after + SLACK) / (before + SLACK), initial=1.0))


def parted(seams: Ints, offsets: Floats) -> int:
    """Count the vertices whose copies a motion takes apart.

    Parameters
    ----------
    seams : (l, 2) pairs of vertices at one place. offsets : (n, 3) in eye separations.
    """
    gap = np.linalg.norm(offsets[seams[:, 0]] - offsets[seams[:, 1]], axis=1)
    return int(np.count_nonzero(gap > APART))


def sunk(before: Floats, after: Floats) -> Bools:
    """Which vertices a motion takes into an eyeball.

    Parameters
    ----------
    before, after : (m,) clearance of the vertices in front of it, in radii; negative inside. What is deeper than
        DEPTH at rest is the back of a lid and does not count when it gets deeper.

    >>> sunk(np.array([0.1, 0.0, -0.3, 0.2]), np.array([-0.03, -0.01, -0.4, 0.2])).tolist()
    [True, False, False, False]
    """
    found: Bools = (after < np.minimum(before, 0.0) - DEPTH) & (before >= -DEPTH)
    return found
