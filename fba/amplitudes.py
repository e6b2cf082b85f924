"""How far a human face moves: a normal, well visible amplitude for each FAP.

The standard's ranges say what a stream can code, which is far more than any face does. These amplitudes are where
motions are judged by eye and by number, and what reference pictures show.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@dataclass(frozen=True, slots=True)
class Amplitude:
    """The amplitudes of one FAP.

    Attributes
    ----------
    fap_id : 3..68.
    negative : a value below 0; None for FAPs with one direction.
    positive : a value above 0.
    reason : what it is on a human face.
    """

    fap_id: int
    negative: int | None
    positive: int
    reason: str

    @property
    def values(self) -> tuple[int, ...]:
        """Positive, then negative."""
        return (self.positive,) if self.negative is None else (self.positive, self.negative)


@cache
def amplitudes() -> Mapping[int, Amplitude]:
    """FAP 3..68 -> its amplitudes.

    >>> amplitudes()[19].values
    (1024, -250)
    """
    text = (files("fba") / "data" / "amplitudes.csv").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = csv.DictReader(lines)
    found = [
        Amplitude(int(r["fap"]), int(r["negative"]) if r["negative"] else None, int(r["positive"]), r["reason"])
        for r in rows
    ]
    return {a.fap_id: a for a in found}
