"""Tables of how good the backends are, from measures on known faces and between kits."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.report.tables import head

Rows = Sequence[Mapping[str, Any]]

OVERVIEW = {
    "truth": "truth error",
    "fapu_truth": "against scaled truth",
    "fp_before": "feature points before correction",
    "fp_after": "finished",
    "lid": "lid gap, middle",
    "lid_worst": "worst",
    "lip": "lip gap",
    "flips%": "flips, %",
}


def overview(rows: Rows) -> str:
    """Mean over all targets; of gaps the worst."""
    lines = [head("", list(OVERVIEW.values()))]
    modes = dict.fromkeys((row["published"], row["backend"]) for row in rows)
    for published, backend in sorted(modes, key=lambda m: m[0]):
        mine = [row for row in rows if row["backend"] == backend and row["published"] == published]
        cells = []
        for key in OVERVIEW:
            found = [row[key] for row in mine if row.get(key) is not None]
            cells.append(max(found) if key.startswith(("li", "lid")) else statistics.mean(found))
        name = f"{backend}, published" if published else f"**{backend}**"
        lines.append(f"| {name} | {' | '.join(f'{c:.3f}' for c in cells)} |")
    return "\n".join(lines) + "\n"


def cross_table(pairs: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """Cosine to the other artist's shapes over the skin, with the cosine at the feature points, and the best scale."""
    names = list(next(iter(pairs.values())))
    lines = [head("", list(pairs))]
    for name in names:
        cells = [
            f"{row['cosine']:.2f} ({row['points_cosine']:.2f}), {row['scale']:.2f}"
            for row in (by_name[name] for by_name in pairs.values())
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
