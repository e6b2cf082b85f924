"""The section of the page that lays an earlier state beside this one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.fidelity import DOCUMENTED
from benchmarks.report import bars, tables
from benchmarks.report.against import changed_fidelity

SECONDS = 0.05
"""Stages that took less are left out."""
LEAST = 0.005
"""Measures on known faces that moved by less are not listed; the page shows three digits."""
SHOWN = 12
NONE = "No earlier state has been measured beside this one yet: `python -m benchmarks.report --against --write`.\n"


def section(found: Mapping[str, Any]) -> str:
    """Speed by turns, what is asked, and measures on known faces."""
    old = found.get("against")
    if not old:
        return NONE
    text = [
        f"Commit {old['commit']} of {old['date']} beside this one. Both ran by turns in one run, each change is the "
        "median of the ratios of its pairs; in brackets what is less than 5 % or of which the pairs disagree.\n",
        tables.turn_table(old["pairs"], SECONDS),
        *bars_table(old["values"], bars.values(found)),
        fidelity_changes(changed_fidelity(old["fidelity"], found.get("fidelity", ()), LEAST)),
    ]
    return "\n".join(text)


def bars_table(then: Mapping[str, float], now: Mapping[str, float]) -> list[str]:
    """Measured bars that do not depend on the machine, and what became of them; none where none is known of both."""
    lines = []
    for bar in bars.BARS:
        old, new = bar.value(then), bar.value(now)
        if old is None or new is None or bar.on_the_clock:
            continue
        lines.append(f"| {bar.what} | {old:.3g} | {new:.3g} | {_verdict(bar, old, new)} |")
    return ["\n".join([tables.head("what is asked", ["then", "now", ""]), *lines]) + "\n"] if lines else []


def _verdict(bar: bars.Bar, old: float, new: float) -> str:
    if f"{old:.2g}" == f"{new:.2g}" or max(old, new) <= bar.aim:
        return "same"
    better = (new > old) if bar.more else (new < old)
    return "better" if better else "**worse**"


def fidelity_changes(changes: Sequence[Mapping[str, Any]]) -> str:
    """How many measures got better and worse, and the largest changes; smaller is better in all of them."""
    worse = [c for c in changes if abs(c["now"]) > abs(c["then"])]
    said = f"Measures on known faces, default modes: {len(changes) - len(worse)} better, {len(worse)} worse"
    if not changes:
        return said.replace("0 better, 0 worse", f"none moved by {LEAST:g} or more") + ".\n"
    lines = [f"{said} (by {LEAST:g} or more)"]
    lines[0] += f"; the {SHOWN} largest:\n" if len(changes) > SHOWN else ":\n"
    lines.append(tables.head("measure", ["backend", "face", "then", "now", ""]))
    for c in changes[:SHOWN]:
        said = "**worse**" if c in worse else "better"
        title = DOCUMENTED[c["measure"]]
        lines.append(f"| {title} | {c['backend']} | {c['target']} | {c['then']:.3f} | {c['now']:.3f} | {said} |")
    return "\n".join(lines) + "\n"
