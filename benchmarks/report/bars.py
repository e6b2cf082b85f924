"""What is asked of the product, what is aimed at, and what was measured."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Values = Mapping[str, float]

LARGE = 10_000
"""Templates with more vertices than this count as those of 20k."""


@dataclass(frozen=True)
class Bar:
    """One line: smaller is better, unless `more`.

    Attributes
    ----------
    what : in words, with the unit.
    key : name of the measured value.
    must, aim : limits.
    above : name of a value that is taken off first: what the source itself has.
    """

    what: str
    key: str
    must: float
    aim: float
    more: bool = False
    above: str = ""

    def value(self, values: Values) -> float | None:
        """The measured value; None where it was not measured."""
        if self.key not in values:
            return None
        return max(values[self.key] - values.get(self.above, 0.0), 0.0)

    @property
    def on_the_clock(self) -> bool:
        """Seconds and frames per second, which depend on the machine and its day."""
        return self.what.endswith((", s", "frames/s"))

    def verdict(self, value: float) -> str:
        """Which of both limits is kept."""
        sign = -1.0 if self.more else 1.0
        if sign * value <= sign * self.aim:
            return "aim met"
        return "met" if sign * value <= sign * self.must else "**missed**"


BARS = (
    Bar("a FAP's own feature point, where farther off than 1 unit, %", "own feature point, %", 0.5, 0.1),
    Bar("feature points of all motions, after correction, relative", "feature points", 0.01, 0.003),
    Bar("the same before correction, `fit`, same topology", "before, same", 0.10, 0.03),
    Bar("the same before correction, `fit`, other topology", "before, other", 0.10, 0.03),
    Bar(
        "cross-talk on other feature points, beyond the source's, %",
        "cross-talk, %",
        5,
        1,
        False,
        "cross-talk, %, source",
    ),
    Bar("truth error, other topology, `fit`", "truth, fit", 0.19, 0.12),
    Bar("truth error, other topology, worst of `dt`, `fmc`, `vtc`", "truth, others", 0.25, 0.18),
    Bar("lip gap, MNS", "lip gap, MNS", 0.01, 0),
    Bar(
        "lid gap after a blink, beyond the source's, IRISD", "lid gap, IRISD", 0.05, 0, False, "lid gap, IRISD, source"
    ),
    Bar("flipped moving triangles, beyond the source's, %", "flips, %", 0.3, 0, False, "flips, %, source"),
    Bar(
        "skin that must rest, beyond the source's, eye separations",
        "still skin, eye separations",
        0,
        0,
        False,
        "still skin, eye separations, source",
    ),
    Bar("neutral face, largest change", "neutral", 0, 0),
    Bar("self mapping, DT, largest error", "self mapping, DT", 1e-6, 1e-8),
    Bar("self mapping, VTC, largest error", "self mapping, VTC", 1e-6, 1e-8),
    Bar("detected points, worst mean of a face, eye widths", "points, mean", 0.08, 0.05),
    Bar("detected points, worst point, eye widths", "points, largest", 0.25, 0.15),
    Bar("88 motions, known map, 20k vertices, FMC, s", "motions, fmc, 20k", 0.5, 0.1),
    Bar("88 motions, known map, 20k vertices, DT, s", "motions, dt, 20k", 1.0, 0.35),
    Bar("88 motions, known map, 20k vertices, VTC, s", "motions, vtc, 20k", 4, 0.8),
    Bar("whole `fba clone`, 20k vertices, files included, s", "whole clone", 20, 6),
    Bar("template fit, 5k, s", "fit, 5k", 3, 0.5),
    Bar("template fit, 20k, s", "fit, 20k", 8, 2.5),
    Bar("playback of a cloned 20k face, head at rest, 4-byte numbers, frames/s", "frames/s, 20k", 1000, 5000, True),
    Bar("picture analogy, set-up with the first expression, s", "analogy, set-up", 3, 1),
    Bar("picture analogy, each further expression, s", "analogy, expression", 0.1, 0.05),
    Bar("VRML with 100k vertices, read, s", "read .wrl, 100k", 1, 0.3),
    Bar("peak memory, 88 motions, 20k, worst of all backends, MB", "memory, 20k", 600, 350),
)


def table(values: Values, reasons: Mapping[str, str]) -> str:
    """Every bar with its value; `reasons` say why one is missed, or its aim."""
    lines = ["| | must | aim | measured | | why |", "|---|---|---|---|---|---|"]
    for bar in BARS:
        value = bar.value(values)
        if value is None:
            lines.append(f"| {bar.what} | {bar.must:g} | {bar.aim:g} | - | not measured | |")
            continue
        said = bar.verdict(value)
        why = "" if said == "aim met" else reasons.get(bar.key, "")
        lines.append(f"| {bar.what} | {bar.must:g} | {bar.aim:g} | {value:.3g} | {said} | {why} |")
    return "\n".join(lines) + "\n"


def fidelity_values(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """What measures on known faces say about the bars: MakeHuman's phenotypes, and ICT-FaceKit's identity with them."""
    found = {(r["backend"], r["target"]): r for r in rows if not r["published"]}
    if not found:
        return {}
    targets = [target for backend, target in found if backend == "fit"]
    same = [t for t in targets if not t.endswith("_dec") and t != "ict"]
    other = [t for t in targets if t.endswith("_dec")]
    return {
        "truth, fit": max(found["fit", t]["truth"] for t in other),
        "truth, others": max(found[b, t]["truth"] for b in ("dt", "fmc", "vtc") for t in other),
        "before, same": max(found["fit", t]["fp_before"] for t in same),
        "before, other": max(found["fit", t]["fp_before"] for t in (*other, "ict") if ("fit", t) in found),
    }


def values(found: Mapping[str, Any]) -> dict[str, float]:
    """The values of the bars in the parts of a report that are known."""
    known: dict[str, float] = {**found.get("faithful", {}), **found.get("pictures", {})}
    known |= fidelity_values(found.get("fidelity", ()))
    for row in found.get("clones", ()):
        if row["backend"] == "fit":
            known["whole clone"] = row["whole"]
    stages, transfers = found.get("stages", {}), found.get("transfers", {})
    for size, row in stages.items():
        rows = {"frames/s": "frames/s, head at rest, 4-byte numbers", "read .wrl": "read .wrl"}
        known |= {f"{what}, {size}": row[name] for what, name in rows.items() if name in row}
    for row in found.get("peers", ()):
        if row["work"].startswith("template fit"):
            known["fit, 5k" if int(re.sub(r"\D", "", row["work"])) < LARGE else "fit, 20k"] = row["ours"]
    for name, rows in transfers.items():
        known[f"motions, {name}, 20k"] = rows["20k"]["motions"]
    if transfers:
        known["memory, 20k"] = max(rows["20k"]["memory"] for rows in transfers.values())
    return known
