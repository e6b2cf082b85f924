"""What FAP 3 does to the lips: the two readings of open_jaw, and which of them a face has.

ISO/IEC 14496-2 defines open_jaw so that it does not by itself open the lips: a stream moves the lips with FAPs 4, 5,
8-11, 51, 52, 55-58. Most players and models let the lower lip go along with the jaw instead.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np

from fat.face import AnimatableFace
from fat.response import Response
from fba.faps import fap
from fba.findings import Finding

Mode = Literal["strict", "practical"]

MEANINGS: Mapping[Mode, str] = MappingProxyType(
    {
        "strict": "the lips stay; the lip FAPs open them, as the standard has it",
        "practical": "the jaw takes the lower lip along and opens the mouth",
    }
)

NOTE = "open_jaw"
"""Key of the mode among the notes of a face."""

JAW = 3
LOWER_LIP = (5, 10, 11)
"""The FAPs that a strict face needs for opening its mouth."""

STAYS = 0.05
"""Share of the chin's way below which the lower lip stays."""

_PROBE_VALUE = 300.0


def open_jaw_mode(face: AnimatableFace) -> Mode | None:
    """Measure which reading the tables of a face follow.

    Returns
    -------
    None where the face has no table for FAP 3 that moves the chin (2.1), or no lower lip (2.3) to measure.
    """
    column = next((k for k, t in enumerate(face.tables) if t.fap_id == JAW), None)
    lip = face.feature_points.get("2.3")
    if column is None or lip is None or lip.shape is None:
        return None
    down = (0.0, -1.0, 0.0)
    chin, lower = Response(face, [{"2.1": down}, {"2.3": down}]).of(column, np.array(_PROBE_VALUE))
    if chin == 0.0:
        return None
    return "strict" if abs(lower) <= STAYS * abs(chin) else "practical"


def closed_mouth(face: AnimatableFace) -> list[Finding]:
    """A warning where a strict face lacks the FAPs that open its mouth."""
    if open_jaw_mode(face) != "strict":
        return []
    keys = {t.fap_id for t in face.tables}
    missing = [f"{k} {fap(k).name}" for k in LOWER_LIP if k not in keys]
    if not missing:
        return []
    message = f"open_jaw leaves the lips, and the FAPs that open them are missing: {', '.join(missing)}"
    return [Finding("warning", "closed-mouth", message, fap(JAW).name)]
