"""Which unit of length a face is modelled in: a remark for people; nothing is ever scaled by it."""

from __future__ import annotations

HUMAN_EYE_SEPARATION = 0.063
"""Metres between the pupils of an adult, mean of men and women (Dodgson 2004, SPIE 5291)."""

_UNITS = (
    ("kilometres", 1e3),
    ("metres", 1.0),
    ("feet", 0.3048),
    ("decimetres", 0.1),
    ("inches", 0.0254),
    ("centimetres", 0.01),
    ("millimetres", 1e-3),
    ("micrometres", 1e-6),
)

_TOLERANCE = 1.35
"""A human head's eye separation is within this factor of the mean: 0.047 m (children) to 0.085 m."""


def guess_unit(es0: float) -> str | None:
    """Name the unit in which this eye separation is human, or None if it is in none of them.

    Parameters
    ----------
    es0 : eye separation in units of the mesh.

    >>> guess_unit(0.615), guess_unit(63.0), guess_unit(1.0), guess_unit(1e5)
    ('decimetres', 'millimetres', None, None)
    """
    best: tuple[float, str] | None = None
    for name, metres in _UNITS:
        ratio = es0 * metres / HUMAN_EYE_SEPARATION
        off = max(ratio, 1.0 / ratio) if ratio > 0.0 else float("inf")
        if off <= _TOLERANCE and (best is None or off < best[0]):
            best = (off, name)
    return None if best is None else best[1]
