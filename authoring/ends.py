"""Where a table ends: constructions go as far as a stream can ask for, a face only until its skin folds."""

from __future__ import annotations

from collections.abc import Mapping

from authoring.construction import Offsets
from authoring.units import added
from cloning.prepare import PreparedFace
from fat.fap_quality import FLIPS_MUST
from fat.quality import flips
from fba.amplitudes import amplitudes

CLOSE = 0.02
"""The end is found to within this share of the first border that folds."""


SPARE = 0.8
"""Share of the limit that is used: a table leaves out the smallest offsets, which count among the moving ones here."""


def unfolded(face: PreparedFace, fap_id: int, borders: Mapping[int, Offsets]) -> dict[int, Offsets]:
    """The borders of one FAP up to where its skin folds, but never below a normal amplitude.

    Beyond a table's last border its last line goes on, so nothing that a stream asks for is lost.

    Parameters
    ----------
    borders : FAP value -> accumulated offsets, both signs.

    Returns
    -------
    The same without the borders at which more triangles flip than a table may have; a new last border stands where
    they begin to.
    """
    kept: dict[int, Offsets] = {}
    for sign in (-1, 1):
        side = {v: o for v, o in sorted(borders.items(), key=lambda row: abs(row[0])) if v * sign > 0}
        normal = max((abs(v) for v in amplitudes()[fap_id].values if v * sign > 0), default=0)
        kept.update(_side(face, side, normal))
    return kept


def _side(face: PreparedFace, side: Mapping[int, Offsets], normal: int) -> dict[int, Offsets]:
    """One side, from zero outwards."""
    kept: dict[int, Offsets] = {}
    before: tuple[int, Offsets] = (0, {})
    for value, offsets in side.items():
        if _folds(face, offsets):
            end = _end(face, before, (value, offsets), normal)
            if end[0] != before[0]:
                kept[end[0]] = end[1]
            return kept
        kept[value] = offsets
        before = (value, offsets)
    return kept


def _end(
    face: PreparedFace, inside: tuple[int, Offsets], outside: tuple[int, Offsets], normal: int
) -> tuple[int, Offsets]:
    """The last place between two borders that does not fold."""
    (near, a), (far, b) = inside, outside
    sign = 1 if far > 0 else -1

    def at(value: int) -> Offsets:
        share = (value - near) / (far - near)
        return added({name: (1.0 - share) * part for name, part in a.items()}, b, share)

    low, high = abs(near), abs(far)
    while high - low > max(1.0, CLOSE * abs(far)):
        middle = (low + high) // 2
        low, high = (low, middle) if _folds(face, at(sign * middle)) else (middle, high)
    value = sign * min(max(low, normal), abs(far))
    return (value, at(value)) if value != near else inside


def _folds(face: PreparedFace, offsets: Offsets) -> bool:
    moved = face.skin.join(offsets) / face.fapu.es0
    return flips(face.skin.vertices, face.skin.triangles, moved) > SPARE * FLIPS_MUST
