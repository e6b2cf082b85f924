"""Why the frames of a player are wrong: the usual mistakes are made on purpose, and what they give is compared."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from fat.face import AnimatableFace
from fat.golden import MIXED, TOLERANCE, Golden, motion_rows, smallest_unit
from fat.mistaken_play import MISTAKES, Mistake
from fat.replay import Replay
from fba.arrays import Bools, Floats
from fba.findings import Finding
from fba.stream import FapStream

ROUNDING = 1e-5
"""Share of a motion that single precision may lose, where a mistake makes motions a thousand times as large."""
NAMED = 4
"""So many motions are named in words."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """A mistake, and the motions in which every frame is as this mistake makes it."""

    what: str
    right: str
    motions: tuple[str, ...]

    def finding(self) -> Finding:
        """In words, with the motions' names."""
        named = ", ".join(self.motions[:NAMED])
        more = len(self.motions) - NAMED
        named += f" and {more} more" if more > 0 else ""
        text = f"it seems that {self.what}: that gives just these frames of {named}; right is: {self.right}"
        return Finding("info", "player-mistake", text)


def explain(
    face: AnimatableFace,
    stream: FapStream,
    found: Golden,
    wrong: Collection[str],
    rules: Collection[str] = (),
    mistakes: Sequence[Mistake] = MISTAKES,
) -> list[Explanation]:
    """Find the mistakes that give just these frames.

    Parameters
    ----------
    wrong : names of the motions that `fat.golden.compare` found to be wrong.
    rules : as there.
    mistakes : those to try.

    Returns
    -------
    The mistake that explains most motions first; motions that no single mistake explains are in none of them.
    """
    rows_of = {name: rows for name, rows in motion_rows(face, stream).items() if name in set(wrong)}
    rows = np.array(sorted(k for some in rows_of.values() for k in some), dtype=np.int32)
    case = Replay(face, stream, found.ids, rows, rules)
    left = set(rows_of)
    explained: dict[int, set[str]] = {}
    for number, mistake in enumerate(mistakes if rows_of else ()):
        right = _fits(case, found, mistake.play(case))
        explained[number] = {n for n, some in rows_of.items() if right[np.searchsorted(rows, some)].all()}
        if explained[number] == left:
            break
    out: list[Explanation] = []
    while left:
        best = max(explained, key=lambda number: len(explained[number] & left))
        motions = explained[best] & left
        if not motions:
            break
        names = tuple(name for name in rows_of if name in motions)
        out.append(Explanation(mistakes[best].what, mistakes[best].right, names))
        left -= motions
    return out


def unexplained(wrong: Sequence[str], explanations: Sequence[Explanation]) -> Finding | None:
    """What to do about frames in which several motions play, where no single mistake explains them."""
    left = set(wrong) - {name for e in explanations for name in e.motions}
    if not left or not left <= set(MIXED):
        return None
    text = "look again when the others are right"
    if set(wrong) <= set(MIXED):
        text = (
            "each motion alone is right, so look at how they come together: displacements of all tables add up in the "
            "shape's own coordinates; then its Transforms apply, the innermost first"
        )
    return Finding("info", "player-mistake", text, ", ".join(name for name in MIXED if name in left))


def _fits(case: Replay, found: Golden, made: Floats) -> Bools:
    """Frames (rows,) that are as a mistake makes them."""
    unit = smallest_unit(case.face)
    away = np.linalg.norm(found.frames[case.rows] - made, axis=2).max(axis=1) / unit
    size = np.linalg.norm(made - found.neutral, axis=2).max(axis=1) / unit
    fits: Bools = away <= TOLERANCE + ROUNDING * size
    return fits
