"""The first table of the page: how good cloning is, in a few lines."""

from __future__ import annotations

import re
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.report import bars
from benchmarks.report.paired import beyond_noise
from benchmarks.report.tables import head

Lines = Sequence[tuple[str, str]]

MINUTES = 120.0
"""Xiang, Chen and Yang: two to three minutes for one individual; the lesser is taken."""
PICTURE = 1.3
"""Seconds of VTC for an expression of 311 x 419 pixels in the paper."""


def summary(found: Mapping[str, Any], papers: str) -> str:
    """Fidelity, speed, and the comparisons; `papers` is the page of the papers made again."""
    lines = [*_asked(found), *_faithful(found), *_fast(found), *_papers(papers), *_peers(found), *_earlier(found)]
    return "\n".join([head("", [""]), *(f"| {what} | {said} |" for what, said in lines)]) + "\n"


def _asked(found: Mapping[str, Any]) -> Lines:
    values = bars.values(found)
    known = [(bar, bar.verdict(value)) for bar in bars.BARS if (value := bar.value(values)) is not None]
    missed = [bar.what for bar, said in known if "missed" in said]
    aims = sum(said == "aim met" for _, said in known)
    said = f"{len(known) - len(missed)} of {len(known)} limits are kept, {aims} of them as well as aimed at"
    return [("what is asked", said + (f"; missed: {'; '.join(missed)}" if missed else ""))]


def _faithful(found: Mapping[str, Any]) -> Lines:
    rows = [r for r in found.get("fidelity", ()) if r["backend"] == "fit"]
    if not rows:
        return []
    default, published = ([r["truth"] for r in rows if r["published"] is p and "truth" in r] for p in (False, True))
    finished = max(r["fp_after"] for r in rows if not r["published"])
    text = (
        f"{statistics.mean(default):.3f} of the motion from the truth on {len(default)} known faces (mean; worst "
        f"{max(default):.3f}; as published {statistics.mean(published):.3f}); feature points {finished:.3f} at worst"
    )
    return [("how faithful, backend `fit`", text)]


def _fast(found: Mapping[str, Any]) -> Lines:
    rows = [r for r in found.get("clones", ()) if r["backend"] == "fit"]
    if not rows:
        return []
    row = rows[0]
    text = f"{row['whole']:.1f} s and {row['memory']:.0f} MB for a whole clone of {row['vertices']:,.0f} vertices"
    pair = found.get("fast", {}).get("fit", {}).get("whole")
    if pair:
        text += f"; with the extra `fast` {pair['now']:.1f} s" + ("" if beyond_noise(pair) else " (no clear change)")
    return [("how fast, from file to file", text)]


def _papers(page: str) -> Lines:
    """The paper's seconds / ours, where the page of the papers has both."""
    found = []
    for paper, ours in re.findall(r"paper: ([\d.,]+)\) \| ([\d.,]+) \|", _between(page, "vtc-times")):
        found.append(float(paper.replace(",", "")) / float(ours.replace(",", "")))
    said = [f"VTC in 3D {_span(found)}"] if found else []
    picture = re.search(r"each further expression, s \|.*\| ([\d.]+) \|$", _between(page, "vtc-2d"), re.MULTILINE)
    if picture:
        said.append(f"in pictures {PICTURE / float(picture[1]):.0f}")
    whole = [float(s) for s in re.findall(r"\| ([\d.]+) \|$", _between(page, "xiang-1"), re.MULTILINE)]
    if whole:
        said.append(f"a whole individual {MINUTES / max(whole):.0f} to {MINUTES / min(whole):.0f}")
    text = f"their seconds / ours: {', '.join(said)} (their machines are of 2005 and 2008): [papers.md](papers.md)"
    return [("against the papers", text)] if said else []


def _between(page: str, name: str) -> str:
    return page.partition(f"<!-- {name} -->")[2].partition(f"<!-- end {name} -->")[0]


def _span(ratios: Sequence[float]) -> str:
    low, high = f"{min(ratios):.1f}", f"{max(ratios):,.0f}"
    return high if len(ratios) == 1 else f"{low} to {high}"


def _peers(found: Mapping[str, Any]) -> Lines:
    rows = [r for r in found.get("peers", ()) if "ratio" in r]
    said = []
    fits = [r for r in rows if r["work"].startswith("template fit")]
    if fits:
        error = statistics.median(r["error"] / r["our error"] for r in fits)
        times = _span([r["ratio"] for r in fits])
        said.append(f"trimesh's template fits take {times} times as long and err {error:.1f} times as much")
    programs = [r for r in rows if not r["work"].startswith("template fit")]
    if programs:
        count = len({r["peer"] for r in programs})
        times = _span([r["ratio"] for r in programs])
        said.append(f"{count} deformation transfer programs take {times} times as long")
    return [("against public programs, same run", "; ".join(said))] if said else []


def _earlier(found: Mapping[str, Any]) -> Lines:
    old = found.get("against")
    if not old:
        return []
    whole = old["pairs"]["fit"]["whole"]
    change = f"x {whole['ratio']:.2f}" if beyond_noise(whole) else "no clear change"
    text = f"commit {old['commit']} of {old['date']}: whole clone {whole['then']:.1f} s, now {whole['now']:.1f} s"
    return [("against itself", f"{text} ({change}): [below](#against-an-earlier-state)")]
