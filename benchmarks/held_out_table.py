"""What becomes of faults in several strengths (`benchmarks.doses`), as a table and in one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.doses import Dose
from benchmarks.measures import Bench
from studio.verdicts import Verdict

Outcomes = Mapping[tuple[str, float], Mapping[str, Verdict]]
"""(fault, strength) -> measure -> verdict; the good face is ("nothing", 0)."""


def outcomes(b: Bench, doses: Sequence[Dose]) -> Outcomes:
    """Check the good face, and each fault in each strength."""
    found = {("nothing", 0.0): b.check(b.face)}
    return found | {(d.name, s): b.check(d.spoil(b, s)) for d in doses for s in d.strengths}


def dose_lines(doses: Sequence[Dose], found: Outcomes) -> list[str]:
    """The faults as a Markdown table: the own measure at each strength, bold where it fails, and what else fails."""
    good = found["nothing", 0.0]
    out = [
        "| fault | its measure | good face | strength: value (**fails**) | related, from | unrelated, from |",
        "|---|---|---|---|---|---|",
    ]
    for dose in doses:
        values = []
        for strength in dose.strengths:
            own = found[dose.name, strength].get(dose.its)
            text = "-" if own is None else f"**{own.value:.3g}**" if own.failed else f"{own.value:.3g}"
            values.append(f"{strength:g}: {text}")
        others = _others(dose, found)
        kin, strangers = (
            ", ".join(f"{code} {at:g}" for code, at in others.items() if (code in dose.kin) == related)
            for related in (True, False)
        )
        own = good.get(dose.its)
        before = "-" if own is None else f"**{own.value:.3g}**" if own.failed else f"{own.value:.3g}"
        name = f"{dose.name}, {dose.unit}".rstrip(", ")
        out.append(f"| {name} | {dose.its} | {before} | {'; '.join(values)} | {kin} | {strangers} |")
    return out


def _others(dose: Dose, found: Outcomes) -> dict[str, float]:
    """Each other measure that fails, but not on the good face, and the strength from which it does."""
    first: dict[str, float] = {}
    for strength in dose.strengths:
        for code, verdict in found[dose.name, strength].items():
            if verdict.failed and code != dose.its and not found["nothing", 0.0][code].failed:
                first.setdefault(code, strength)
    return first


def summary(doses: Sequence[Dose], found: Outcomes) -> str:
    """How many faults are caught, from which strength, and what fails for another's fault."""

    def caught(dose: Dose, strength: float) -> bool:
        own = found[dose.name, strength].get(dose.its)
        return own is not None and own.failed and not found["nothing", 0.0][dose.its].failed

    at_all = [d for d in doses if any(caught(d, s) for s in d.strengths)]
    missed = [d.name for d in doses if d not in at_all]
    firm = [d for d in doses if len(d.strengths) == 1 or caught(d, d.strengths[-2])]
    strangers = [d.name for d in doses if set(_others(d, found)) - set(d.kin)]
    bad = ", ".join(code for code, v in found["nothing", 0.0].items() if v.failed) or "none"
    spent = sum(d.its in found["nothing", 0.0] and found["nothing", 0.0][d.its].failed for d in doses)
    apart = f" ({spent} of these measures fail on the good clone already, and so see nothing)" if spent else ""
    return (
        f"Measures that the good clone fails: {bad}{apart}. Of {len(doses)} faults, {len(at_all)} are seen by their "
        f"measure at the grossest strength or before, {len(firm)} at the second grossest. "
        f"Not seen: {'; '.join(missed) or 'none'}. "
        f"An unrelated measure fails for: {'; '.join(strangers) or 'none'}."
    )
