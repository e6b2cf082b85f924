"""The report's numbers as they stand in docs/benchmarks.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Rows = Mapping[str, Mapping[str, float]]
"""Size -> what was measured there."""


def exponent(rows: Rows, key: str) -> float:
    """The power of the number of vertices by which a value grows, by least squares."""
    sizes = np.log([row["vertices"] for row in rows.values()])
    values = np.log([max(row[key], 1e-6) for row in rows.values()])
    return float(np.polyfit(sizes, values, 1)[0]) if len(sizes) > 1 else float("nan")


def stage_table(stages: Rows) -> str:
    """Every stage at every size."""
    first = next(iter(stages.values()))
    lines = [_head("", [f"{row['vertices']:,.0f} vertices" for row in stages.values()], "grows as n to the")]
    for key in first:
        if key == "vertices" or key.startswith(("frames", "MB")):
            continue
        values = [f"{row[key]:.2f}" for row in stages.values()]
        megabytes = key.replace("write", "MB")
        if megabytes != key and megabytes in first:
            values = [f"{v}, {row[megabytes]:.1f} MB" for v, row in zip(values, stages.values(), strict=True)]
        lines.append(f"| {key} | {' | '.join(values)} | {exponent(stages, key):.2f} |")
    for key in (k for k in first if k.startswith("frames")):
        values = [f"{row[key]:,.0f}" for row in stages.values()]
        lines.append(f"| {key} | {' | '.join(values)} | {exponent(stages, key):.2f} |")
    return "\n".join(lines) + "\n"


def transfer_table(transfers: Mapping[str, Rows]) -> str:
    """Correspondence, 88 motions and memory of every backend at every size."""
    sizes = next(iter(transfers.values()))
    lines = [_head("", [f"{row['vertices']:,.0f} vertices" for row in sizes.values()], "grows as n to the")]
    for key, title, digits in (
        ("correspondence", "correspondence, s", 2),
        ("motions", "88 motions, known map, s", 3),
        ("memory", "peak memory, MB", 0),
    ):
        lines.append(f"| **{title}** |{' |' * (len(sizes) + 1)}")
        for backend, rows in transfers.items():
            values = " | ".join(f"{row[key]:.{digits}f}" for row in rows.values())
            lines.append(f"| {backend} | {values} | {exponent(rows, key):.2f} |")
    return "\n".join(lines) + "\n"


def clone_table(clones: Sequence[Mapping[str, Any]]) -> str:
    """Whole clones, stage by stage."""
    names = [k for k in clones[0] if k not in ("head", "backend", "vertices", "size")]
    last = {"memory": "peak memory", "known map": "88 motions, known map", "whole": "**whole**"}
    lines = [_head("vertices | backend", [last.get(n, n) for n in names])]
    for row in clones:
        shown = [f"{row[n]:.0f} MB" if n == "memory" else f"{row[n]:.2f}" for n in names]
        shown[names.index("whole")] = f"**{row['whole']:.1f}**"
        lines.append(f"| {row['vertices']:,.0f} | {row['backend']} | {' | '.join(shown)} |")
    return "\n".join(lines) + "\n"


def peer_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Other programs beside ours."""
    lines = [_head("work | program", ["theirs, s", "ours, s", "theirs / ours", "their error", "our error"])]
    for row in rows:
        if "failed" in row:
            lines.append(f"| {row['work']} | {row['peer']} | did not run: {row['failed']} | | | | |")
            continue
        lines.append(
            f"| {row['work']} | {row['peer']} | {row['seconds']:.2f} | {row['ours']:.2f} | {row['ratio']:.1f} | "
            f"{row['error']:.2g} | {row['our error']:.2g} |"
        )
    return "\n".join(lines) + "\n"


def _head(first: str, names: Sequence[str], last: str = "") -> str:
    columns = [first, *names, *([last] if last else [])]
    return f"| {' | '.join(columns)} |\n|{'---|' * (len(names) + first.count('|') + 1 + bool(last))}"
