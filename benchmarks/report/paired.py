"""Two ways of doing the same work, by turns in one run: A B A B; medians of the ratios of each pair."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.report.processes import measured

LEAST = 0.05
"""A change of less than this share is noise, and so is one of which the pairs disagree whether it is up or down."""


@dataclass(frozen=True)
class Side:
    """One of both ways: another folder of the program, or other variables of the environment."""

    folder: Path | None = None
    setting: Mapping[str, str] = field(default_factory=dict)


def paired(then: Side, now: Side, runs: int, module: str, *arguments: str) -> dict[str, dict[str, float]]:
    """Run a module that prints JSON on both sides by turns; what both measure, as of `compared`."""
    pairs = []
    for _ in range(runs):
        one, other = (measured(module, *arguments, folder=s.folder, setting=s.setting) for s in (then, now))
        pairs.append((one, other))
    return compared(pairs)


def compared(pairs: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> dict[str, dict[str, float]]:
    """Name -> medians of both sides, median of the ratios now / then, and the least and the largest of them."""
    found = {}
    for key in (k for k in pairs[0][0] if k in pairs[0][1]):
        values = [(float(one[key]), float(other[key])) for one, other in pairs]
        ratios = [now / then if then else 1.0 for then, now in values]
        found[key] = {
            "then": statistics.median(then for then, _ in values),
            "now": statistics.median(now for _, now in values),
            "ratio": statistics.median(ratios),
            "least": min(ratios),
            "largest": max(ratios),
            "pairs": len(pairs),
        }
    return found


def beyond_noise(row: Mapping[str, float]) -> bool:
    """Some pairs agree that there is a change, and it is no small one."""
    agreed = row["pairs"] > 1 and (row["least"] > 1.0 or row["largest"] < 1.0)
    return agreed and abs(row["ratio"] - 1.0) > LEAST
