"""Findings of one kind as one line: how many motions have it, and the worst of them by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fat.conformance import OWN_SHARE, FapConformance
from fat.fap_quality import ASYMMETRY_MAY, CROSS_TALK_MUST, FLIPS_MUST, PENETRATION_MUST, STRETCH_MUST, FapQuality
from fba.findings import Finding

FEW = 2
"""So many findings of one kind are told one by one."""

NAMED = 3
"""So many of the others are named."""


@dataclass(frozen=True, slots=True)
class _Kind:
    """What all findings with a code say, the number that each has, and how that is written."""

    text: str
    read: Callable[[FapQuality], float | None]
    form: str
    factor: float = 1.0


_KINDS: Mapping[str, _Kind] = {
    "fap-cross-talk": _Kind(
        f"another FAP's feature point moves by more than {100 * CROSS_TALK_MUST:g} % of the own",
        lambda row: row.cross_talk,
        "{:.1f} %",
        100.0,
    ),
    "fap-flips": _Kind("triangles turn over at a normal amplitude", lambda row: row.flips, "{:.2f} %"),
    "fap-flips-at-limit": _Kind(
        f"more than {FLIPS_MUST:g} % of the moving triangles turn over as far as the table goes",
        lambda row: row.flips_at_limit,
        "{:.2f} %",
    ),
    "fap-tear": _Kind(
        f"an edge of hidden skin gets more than {STRETCH_MUST:g} times as long", lambda row: row.stretch, "{:.1f} times"
    ),
    "fap-seam": _Kind("vertices come apart along a seam", lambda row: row.parted, "{:.0f}"),
    "fap-lining": _Kind("vertices of the lining come through the skin before it", lambda row: row.through, "{:.0f}"),
    "fap-penetration": _Kind(
        f"more than {PENETRATION_MUST:g} % of the skin before the eyeballs gets into them",
        lambda row: row.penetration,
        "{:.2f} %",
    ),
    "fap-asymmetry": _Kind(
        f"the motion differs from its mirror image by more than {100 * ASYMMETRY_MAY:g} %",
        lambda row: row.asymmetry,
        "{:.1f} %",
        100.0,
    ),
}
_OWN = f"a FAP moves its feature point too far or not far enough, by more than {100 * OWN_SHARE:g} %"


def grouped(findings: Sequence[Finding], rows: Sequence[FapQuality], faps: Sequence[FapConformance]) -> list[Finding]:
    """Replace findings of one kind by one, where there are more than FEW of them.

    Parameters
    ----------
    findings : those about motions are told together, all others stay as they are.
    rows, faps : what the findings are about.
    """
    amounts = {
        (code, row.where): (kind.factor * value, kind.form, row.where)
        for row in rows
        for code, kind in _KINDS.items()
        if (value := kind.read(row)) is not None
    }
    amounts |= {
        ("own-fp", f"FAP {f.fap_id}"): (100.0 * f.relative_error, "{:.2f} %", f"{f.name} at {f.value:+d}") for f in faps
    }
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        key = finding.where if (finding.code, finding.where) not in amounts else ""
        kinds.setdefault((finding.code, key), []).append(finding)
    out = []
    for (code, _), alike in kinds.items():
        if len(alike) <= FEW:
            out += alike
            continue
        worst = sorted((amounts[code, f.where] for f in alike), key=lambda a: -a[0])
        named = ", ".join(f"{where} ({form.format(amount)})" for amount, form, where in worst[:NAMED])
        text = _OWN if code == "own-fp" else _KINDS[code].text
        others = len(alike) - NAMED
        more = f" and {others} more" if others > 0 else ""
        out.append(Finding(alike[0].severity, code, f"{text}, in {len(alike)} motions: {named}{more}"))
    return out


__all__ = ["FEW", "NAMED", "grouped"]
