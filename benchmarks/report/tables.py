"""The report's numbers as they stand in docs/benchmarks.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.report.paired import beyond_noise

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
    lines = [head("", [f"{row['vertices']:,.0f} vertices" for row in stages.values()], "grows as n to the")]
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
    lines = [head("", [f"{row['vertices']:,.0f} vertices" for row in sizes.values()], "grows as n to the")]
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
    lines = [head("vertices | backend", [last.get(n, n) for n in names])]
    for row in clones:
        shown = [f"{row[n]:.0f} MB" if n == "memory" else f"{row[n]:.2f}" for n in names]
        shown[names.index("whole")] = f"**{row['whole']:.1f}**"
        lines.append(f"| {row['vertices']:,.0f} | {row['backend']} | {' | '.join(shown)} |")
    return "\n".join(lines) + "\n"


def peer_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Other programs beside ours."""
    lines = [head("work | program", ["theirs, s", "ours, s", "theirs / ours", "their error", "our error"])]
    for row in rows:
        if "failed" in row:
            lines.append(f"| {row['work']} | {row['peer']} | did not run: {row['failed']} | | | | |")
            continue
        lines.append(
            f"| {row['work']} | {row['peer']} | {row['seconds']:.2f} | {row['ours']:.2f} | {_factor(row['ratio'])} | "
            f"{row['error']:.2g} | {row['our error']:.2g} |"
        )
    return "\n".join(lines) + "\n"


def playback_table(faces: Mapping[str, Mapping[str, float]]) -> str:
    """Frames per second of the player and of a plain loop."""
    lines = [head("", [*next(iter(faces.values())), "plain sum / plain loop"])]
    for what, row in faces.items():
        speeds = [f"{speed:,.0f}" for speed in row.values()]
        lines.append(f"| {what} | {' | '.join(speeds)} | {row['by the plain sum'] / row['plain loop']:.0f} |")
    return "\n".join(lines) + "\n"


def format_table(what: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """Seconds to write and to read, and MB, of every format."""
    lines = [head("", [f"{name}: write, read, size" for name in what])]
    for extension in dict.fromkeys(name for rows in what.values() for name in rows):
        cells = [_there_and_back(rows.get(extension, {})) for rows in what.values()]
        lines.append(f"| {extension} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _there_and_back(row: Mapping[str, float]) -> str:
    if "write" not in row:
        return f"-, {row['read']:.2f} s" if row else "-"
    return f"{row['write']:.2f} s, {row['read']:.2f} s, {row['MB']:.1f} MB"


def compact_table(found: Mapping[str, Mapping[str, float]]) -> str:
    """An exact clone beside the default one."""
    first = next(iter(found.values()))
    names = [key.removeprefix("write ") for key in first if key.startswith("write ")]
    others = [key for key in first if not key.startswith(("write ", "MB "))]
    lines = [head("", [*names, *others])]
    for what, row in found.items():
        cells = [f"{row[f'MB {n}']:.1f} MB, {row[f'write {n}']:.2f} s" for n in names]
        lines.append(f"| {what} | {' | '.join([*cells, *(f'{row[k]:.2g}' for k in others)])} |")
    return "\n".join(lines) + "\n"


def turn_table(pairs: Mapping[str, Mapping[str, Mapping[str, float]]], least: float) -> str:
    """What two sides took by turns; a change that is noise is in brackets."""
    clones = {name: rows for name, rows in pairs.items() if name != "stages"}
    lines = [head("whole clone, 20k", list(clones))]
    for key in next(iter(clones.values())):
        if key in ("vertices", "size") or max(rows[key]["then"] for rows in clones.values()) < least:
            continue
        shown = _row_name(key)
        lines.append(f"| {shown} | {' | '.join(_change(rows[key], key == 'memory') for rows in clones.values())} |")
    table = "\n".join(lines) + "\n"
    if "stages" not in pairs:
        return table
    rows = [head("stage, 20k", ["seconds or frames/s"])]
    for key, row in pairs["stages"].items():
        if key != "vertices" and not key.startswith("MB") and row["then"] >= least:
            rows.append(f"| {key} | {_change(row, key.startswith('frames'))} |")
    return table + "\n" + "\n".join(rows) + "\n"


def _row_name(key: str) -> str:
    return {"whole": "**whole**", "known map": "88 motions, known map", "memory": "peak memory, MB"}.get(key, key)


def _change(row: Mapping[str, float], whole_numbers: bool) -> str:
    digits = 0 if whole_numbers else 2
    ratio = f"{row['ratio']:.2f}"
    shown = f"**x {ratio}**" if beyond_noise(row) else f"(x {ratio})"
    return f"{row['then']:,.{digits}f} to {row['now']:,.{digits}f} {shown}"


def _factor(ratio: float) -> str:
    return f"{ratio:.1f}" if ratio < 100 else f"{ratio:,.0f}"


def head(first: str, names: Sequence[str], last: str = "") -> str:
    """The head of a table, and the line below it."""
    columns = [first, *names, *([last] if last else [])]
    return f"| {' | '.join(columns)} |\n|{'---|' * (len(names) + first.count('|') + 1 + bool(last))}"
