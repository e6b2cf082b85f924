"""Is a face in MPEG-4's neutral pose? Streams look right only on a face that starts from there.

The neutral face of ISO/IEC 14496-2 gazes along +Z with its head upright, lids tangent to the iris, lips in contact,
the lip line horizontal at the height of the corners, teeth touching, and a flat tongue with its tip between the
teeth. Free models seldom are: the two real heads measured for this toolkit have lips 40 to 120 MNS/1024 apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.arrays import Floats
from fba.fapu import FAPU_DIVISOR, Fapu
from fba.feature_points import FeaturePoints
from fba.findings import Finding
from fba.landmark_checks import pairs
from fba.scene import FaceScene, Role
from fba.sphere import fit_sphere
from fba.units import HUMAN_EYE_SEPARATION, guess_unit

LIP_TOLERANCE = 20.0
"""MNS/1024: about 0.4 mm on a human face, less than the rounding of a lip edge."""

CORNER_TOLERANCE = 50.0
"""MNS/1024: about 1 mm on a human face."""

TEETH_TOLERANCE = 30.0
"""MNS/1024."""

IRIS_PER_EYE_SEPARATION = (0.138, 0.241)
"""Lid opening / eye separation at which lids pass for tangent to the iris: human irises have 10.2 to 13.0 mm, human
pupils are 54 to 74 mm apart. The eyeball is no measure: models have eyeballs of any size below the skin."""

PUPIL_TOLERANCE = 0.25
"""IRISD by which a pupil may lie off the middle between the lids."""

GAZE_TOLERANCE = 5.0
"""Degrees; also, without eyeballs, percent of the eye width by which both pupils may lie to one side."""

TILT_TOLERANCE = 3.0
"""Degrees of head roll or yaw."""

TONGUE_REACH = 0.3
"""MNS between the tip of the tongue and the top of the lower teeth."""

TONGUE_SLOPE = 30.0
"""Degrees by which the tongue may rise or fall from its middle to its tip."""

_Points = Mapping[str, Floats]


def check_neutral(scene: FaceScene, points: FeaturePoints, fapu: Fapu) -> list[Finding]:
    """Compare a face with MPEG-4's neutral pose.

    Parameters
    ----------
    scene : in inside axes.
    points : checks whose feature points are missing are left out.
    fapu : the units of this face.

    Returns
    -------
    One finding for each rule that is broken, with the amounts in FAP units and in units of the mesh. Nothing is
    an error: such a face can be animated, but streams made for a neutral face will look off by these amounts.
    """
    at = points.positions(scene)
    return [
        *_lips(at, fapu),
        *_lip_corners(at, fapu),
        *_lids(scene, at, fapu),
        *_pupils(at),
        *_gaze(scene, at),
        *_head(at),
        *_teeth(at, fapu),
        *_tongue(at, fapu),
        *_units(scene, fapu),
    ]


def _has(at: _Points, *ids: str) -> bool:
    return all(i in at for i in ids)


def _in_mns(length: float, fapu: Fapu) -> float:
    return length / fapu.mns0 * FAPU_DIVISOR


def _lips(at: _Points, fapu: Fapu) -> list[Finding]:
    rows = [("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")]
    gaps = {f"{a}/{b}": float(at[a][1] - at[b][1]) for a, b in rows if _has(at, a, b)}
    findings = []
    for code, sign, words, advice in (
        ("lip-gap", 1.0, "the lips are apart", "close the mouth in the model, or expect it to stay a little open"),
        ("lip-overlap", -1.0, "the lips overlap", "part them in the model, or expect them to cut into each other"),
    ):
        off = {k: g for k, g in gaps.items() if sign * _in_mns(g, fapu) > LIP_TOLERANCE}
        if off:
            amounts = ", ".join(f"{abs(_in_mns(g, fapu)):.0f} at {k} ({abs(g):.4g})" for k, g in off.items())
            message = f"{words} by {amounts} MNS/1024 (mesh units); MPEG-4's neutral lips touch: {advice}"
            findings.append(Finding("warning", code, message, next(iter(off)).split("/")[0]))
    return findings


def _lip_corners(at: _Points, fapu: Fapu) -> list[Finding]:
    if not _has(at, "2.2", "2.3", "2.4", "2.5"):
        return []
    line = 0.5 * float(at["2.2"][1] + at["2.3"][1])
    off = {i: float(at[i][1]) - line for i in ("2.4", "2.5")}
    if max(abs(_in_mns(d, fapu)) for d in off.values()) <= CORNER_TOLERANCE:
        return []
    amounts = " and ".join(
        f"{i} lies {abs(_in_mns(d, fapu)):.0f} MNS/1024 ({abs(d):.4g} mesh units) {'above' if d > 0 else 'below'} it"
        for i, d in off.items()
    )
    message = f"the lip corners are not at the height of the lip line: {amounts}; the model smiles or frowns at rest"
    return [Finding("warning", "lip-corners", message, "2.4")]


_EYES = (
    ("left", Role.EYE_LEFT, "3.5", "3.1", "3.3"),
    ("right", Role.EYE_RIGHT, "3.6", "3.2", "3.4"),
)


def _eyeball(scene: FaceScene, role: Role) -> tuple[Floats, float] | None:
    """Centre and radius of an eyeball; None without eye shapes, or where they are no ball (a flat disc)."""
    shapes = scene.with_role(role)
    if not shapes:
        return None
    vertices = np.concatenate([scene.world_vertices(s.name) for s in shapes])
    center, radius, error = fit_sphere(vertices)
    half = 0.5 * float(np.ptp(vertices, axis=0).max())
    round_enough = radius > 0.0 and error < 0.15 * radius and 0.5 * half < radius < 2.0 * half
    return (center, radius) if round_enough else None


def _lids(scene: FaceScene, at: _Points, fapu: Fapu) -> list[Finding]:
    findings = []
    gaps = []
    for side, _, _, upper, lower in _EYES:
        if not _has(at, upper, lower):
            continue
        gap = float(at[upper][1] - at[lower][1])
        gaps.append(gap)
        low, high = IRIS_PER_EYE_SEPARATION
        share = gap / fapu.es0
        if not low <= share <= high:
            wide = "wide" if share > high else "narrow"
            message = (
                f"the {side} eye is open {gap:.4g} mesh units, {share:.2f} of the eye separation; lids tangent to a "
                f"human iris give {low:.2f} to {high:.2f}. The lids look {wide}, and lid motions are scaled by this "
                f"opening (IRISD0): they will be too {'large' if wide == 'wide' else 'small'} unless the eyes are "
                "stylised on purpose"
            )
            findings.append(Finding("warning", "lid-opening", message, upper))
    if len(gaps) == 2 and abs(gaps[0] - gaps[1]) > 0.1 * max(gaps):
        message = (
            f"the left eye is open {gaps[0]:.4g} mesh units, the right one {gaps[1]:.4g}; both use their mean as IRISD0"
        )
        findings.append(Finding("warning", "lids-uneven", message, "3.1"))
    return findings


def _pupils(at: _Points) -> list[Finding]:
    findings = []
    for side, _, pupil, upper, lower in _EYES:
        if not _has(at, pupil, upper, lower):
            continue
        opening = float(at[upper][1] - at[lower][1])
        off = float(at[pupil][1]) - 0.5 * float(at[upper][1] + at[lower][1])
        if abs(off) > PUPIL_TOLERANCE * opening:
            way = "above" if off > 0 else "below"
            message = (
                f"the {side} pupil {pupil} lies {abs(off) / opening:.2f} lid openings {way} the middle between the "
                "lids: the eye looks up or down, or the point is misplaced"
            )
            findings.append(Finding("warning", "pupil-height", message, pupil))
    return findings


def _gaze(scene: FaceScene, at: _Points) -> list[Finding]:
    findings = []
    balls = 0
    for side, role, pupil, _, _ in _EYES:
        ball = _eyeball(scene, role)
        if ball is None or pupil not in at:
            continue
        balls += 1
        x, y, z = (at[pupil] - ball[0]).tolist()
        yaw, pitch = np.degrees(np.arctan2(x, z)), -np.degrees(np.arctan2(y, np.hypot(x, z)))
        if max(abs(yaw), abs(pitch)) > GAZE_TOLERANCE:
            message = (
                f"the {side} eye gazes {abs(yaw):.1f} degrees to the {'left' if yaw > 0 else 'right'} and "
                f"{abs(pitch):.1f} degrees {'down' if pitch > 0 else 'up'} (pupil {pupil} against the centre of the "
                "eyeball); neutral eyes gaze straight ahead"
            )
            findings.append(Finding("warning", "gaze", message, pupil))
    if not balls and _has(at, "3.5", "3.6", "3.7", "3.8", "3.11", "3.12"):
        shifts = []
        for pupil, left, right in (("3.5", "3.7", "3.11"), ("3.6", "3.8", "3.12")):
            width = float(at[left][0] - at[right][0])
            shifts.append((float(at[pupil][0]) - 0.5 * float(at[left][0] + at[right][0])) / width if width else 0.0)
        share = 50.0 * sum(shifts)
        if abs(share) > GAZE_TOLERANCE:
            message = (
                f"both pupils lie {abs(share):.0f} % of the eye width to the {'left' if share > 0 else 'right'} of the "
                "middle of the eyes; neutral eyes gaze straight ahead"
            )
            findings.append(Finding("warning", "gaze", message, "3.5"))
    return findings


def _head(at: _Points) -> list[Finding]:
    both = pairs(at)
    if not both:
        return []
    x, y, z = np.sum([at[a] - at[b] for a, b in both], axis=0).tolist()
    roll, yaw = float(np.degrees(np.arctan2(y, x))), float(np.degrees(np.arctan2(-z, x)))
    if max(abs(roll), abs(yaw)) <= TILT_TOLERANCE:
        return []
    message = (
        f"the head is tilted {abs(roll):.1f} degrees to its {'right' if roll > 0 else 'left'} shoulder and turned "
        f"{abs(yaw):.1f} degrees to its {'left' if yaw > 0 else 'right'} (from {len(both)} pairs of feature points); "
        "turn the model upright, or motions go askew"
    )
    return [Finding("warning", "head-tilt", message)]


def _teeth(at: _Points, fapu: Fapu) -> list[Finding]:
    if not _has(at, "9.10", "9.11"):
        return []
    gap = float(at["9.10"][1] - at["9.11"][1])
    units = _in_mns(gap, fapu)
    if abs(units) <= TEETH_TOLERANCE:
        return []
    how = "apart" if gap > 0 else "overlapping (as in a normal bite, or the jaw is shut too far)"
    message = f"the teeth are {how} by {abs(units):.0f} MNS/1024 ({abs(gap):.4g} mesh units); neutral teeth touch"
    return [Finding("warning" if gap > 0 else "info", "teeth-gap", message, "9.10")]


def _tongue(at: _Points, fapu: Fapu) -> list[Finding]:
    findings = []
    if _has(at, "6.1", "9.11"):
        reach = float(np.linalg.norm(at["6.1"] - at["9.11"]))
        if reach > TONGUE_REACH * fapu.mns0:
            message = (
                f"the tip of the tongue is {_in_mns(reach, fapu):.0f} MNS/1024 ({reach:.4g} mesh units) away from the "
                "top of the lower teeth; the neutral tongue touches it"
            )
            findings.append(Finding("info", "tongue-tip", message, "6.1"))
    if _has(at, "6.1", "6.2"):
        run = at["6.1"] - at["6.2"]
        slope = float(np.degrees(np.arctan2(run[1], np.hypot(run[0], run[2]))))
        if abs(slope) > TONGUE_SLOPE:
            message = f"the tongue {'rises' if slope > 0 else 'falls'} by {abs(slope):.0f} degrees; neutral is flat"
            findings.append(Finding("info", "tongue-slope", message, "6.1"))
    return findings


def _units(scene: FaceScene, fapu: Fapu) -> list[Finding]:
    if scene.meters_per_unit is not None:
        separation = fapu.es0 * scene.meters_per_unit
        if guess_unit(separation) != "metres":
            message = (
                f"the eye separation is {fapu.es0:.4g} units, which the file makes {separation:.4g} m; a human one is "
                f"{HUMAN_EYE_SEPARATION} m. Motions scale with the face, but other software may show it in a wrong size"
            )
            return [Finding("warning", "unit", message)]
        return []
    unit = guess_unit(fapu.es0)
    if unit == "metres":
        return []
    known = f"so the model is probably in {unit}" if unit else "which is human in no common unit"
    message = f"the eye separation is {fapu.es0:.4g}, {known}; MPEG-4 players expect metres ({HUMAN_EYE_SEPARATION})"
    return [Finding("info", "unit", message)]
