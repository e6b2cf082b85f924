"""How sure a detected point is, and what to tell a person about it."""

from __future__ import annotations

from collections.abc import Mapping

from cloning.prepare import NECESSARY
from fba.feature_points import FeaturePoints, feature_point_definitions
from fba.findings import Finding

LOW = 0.5
"""Points below this should be looked at: they may be off by more than `HALF`."""

HALF = 0.15
"""Expected error, in eye widths, at which a point is as likely good as bad."""

RULED = 0.03
"""Error of a point that a rule has found, in eye widths; measured 0.00 to 0.06 on lips and lids."""

CARRIED = {"2": 0.08, "3": 0.07, "4": 0.11, "5": 0.1, "8": 0.07, "9": 0.09, "10": 0.14, "11": 0.25}
"""Error of a point that no rule has found, by group, in eye widths; measured on nine heads. Ears and skull have no
sharp features."""

VAGUE = {"2.11": 0.12, "2.12": 0.12, "2.13": 0.22, "2.14": 0.22}
"""The same of the chin's and the jaw's corners."""

EYE_WIDTHS = 2.2
"""Eye widths in an eye separation."""

SURE_FACE = 0.85
"""Agreement with the source's face below which everything is less certain."""


def confidences(
    score: float, keys: Mapping[str, object], ruled: Mapping[str, float], residual: Mapping[str, float]
) -> dict[str, float]:
    """Confidence 0..1 of each point: 0.5 where an error of 0.15 eye widths is expected.

    Parameters
    ----------
    score : agreement of the whole face.
    ruled : distance between what the rule and what the fit said, for the points that a rule has found; ES.
    residual : distance of the fitted template from the skin at each point, ES.
    """
    found = {}
    for key in keys:
        if key in ruled:
            error = RULED + 0.2 * EYE_WIDTHS * ruled[key]
        else:
            error = VAGUE.get(key, CARRIED[key.split(".", maxsplit=1)[0]])
            error += EYE_WIDTHS * residual.get(key, 0.0)
        error += max(SURE_FACE - score, 0.0)
        found[key] = round(1.0 / (1.0 + (error / HALF) ** 2), 3)
    return found


def describe(points: FeaturePoints, score: float, name: str) -> tuple[Finding, ...]:
    """What a person should know about detected points."""
    detected = {key: p for key, p in points.items() if p.source == "detected"}
    mean = sum(p.confidence for p in detected.values()) / max(len(detected), 1)
    known = feature_point_definitions()
    findings = [
        Finding(
            "info",
            "detected-points",
            f"{len(detected)} feature points were detected, mean confidence {mean:.2f}; the face agrees with the "
            f"source's by {score:.2f}",
            name,
        )
    ]
    weak = [key for key, p in detected.items() if p.confidence < LOW and key in NECESSARY]
    if weak:
        named = ", ".join(f"{key} ({known[key].definition})" for key in weak)
        findings.append(
            Finding(
                "warning",
                "uncertain-points",
                f"these detected points may be off by more than {HALF:g} eye widths: {named}. Look at them "
                "(fba landmarks FACE -o POINTS.json --sheet PICTURE.png) and give the right ones with --landmarks",
                weak[0],
            )
        )
    return tuple(findings)
