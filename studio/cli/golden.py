"""``fba check FACE --stream S --golden G``: are the frames of another player right?"""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

import typer

from studio.cli.outcome import Outcome, usage


def check_golden(face: Path, stream: Path | None, golden: Path | None, rules: str, as_json: bool) -> None:
    """Compare frames with what the face's tables say; ends with 1 when a vertex is off by more than a FAP unit."""
    from fat.golden import TOLERANCE, compare
    from fat.player_mistakes import explain, unexplained
    from formats import read_face
    from formats.golden import read_golden
    from studio.cli.arguments import parse_rules
    from studio.cli.console import console, findings_json, print_findings, print_json, table
    from studio.streams import open_stream

    if stream is None or golden is None:
        usage("--stream and --golden go together: what was played, and the frames that came of it")
    try:
        chosen = parse_rules(rules)
    except ValueError as error:
        usage(f"--rules: {error}")
    frames, _ = open_stream(stream)
    shown, theirs = read_face(str(face)), read_golden(golden)
    found = compare(shown, frames, theirs, chosen)
    wrong = [d.finding() for d in found if not d.passed]
    names = [d.name for d in found if not d.passed]
    why = explain(shown, frames, theirs, names, chosen)
    if as_json:
        rows = [{**asdict(d), "passed": d.passed} for d in found]
        given = {"file": str(face), "stream": str(stream), "golden": str(golden), "tolerance": TOLERANCE}
        told = {"motions": rows, "findings": findings_json(wrong), "explanations": [asdict(e) for e in why]}
        print_json({**given, **told, "passed": not wrong})
    else:
        out = console()
        head = ("motion", ">frames", ">largest, FAP units", ">in frame", ">vertex", ">factor", "")
        lines = [
            (
                d.name,
                str(d.frames),
                f"{d.largest:.4g}",
                str(d.frame),
                str(d.vertex),
                "" if math.isnan(d.factor) else f"{d.factor:.5f}",
                "ok" if d.passed else "FAILED",
            )
            for d in found
        ]
        table("", head, lines, out)
        clear = {name for e in why for name in e.motions}
        print_findings([finding for finding in wrong if finding.where not in clear], out)
        print_findings([e.finding() for e in why], out)
        rest = unexplained(names, why)
        print_findings([rest] if rest else [], out)
        out.print(f"{golden}: {len(found) - len(wrong)} of {len(found)} motions are right")
    if wrong:
        raise typer.Exit(Outcome.FINDINGS)
