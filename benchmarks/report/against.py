"""An earlier state of the product beside this one: its code by turns with today's, and what it had measured."""

from __future__ import annotations

import io
import json
import subprocess
import tarfile
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.report import bars
from benchmarks.report.paired import Side

ROOT = Path(__file__).resolve().parents[2]
NUMBERS, PAGE = "docs/benchmarks.json", "docs/benchmarks.md"
WEEK = "7.days.ago"


def week_old() -> str:
    """The last commit that is a week old; in a younger history the first one that had a report."""
    old = _git("rev-list", "-1", f"--before={WEEK}", "HEAD").strip()
    return old or _git("log", "--format=%h", "--diff-filter=A", "--", NUMBERS).split()[-1]


def against(revision: str, by_turns: Callable[[tuple[Side, Side]], Any]) -> dict[str, Any]:
    """Measure a commit by turns with this state, and keep what it had measured.

    Parameters
    ----------
    revision : a commit of this repository.
    by_turns : measures both sides.
    """
    commit, date = _git("log", "-1", "--format=%h %cs", revision, "--").split()
    numbers, page = (_file(revision, path) for path in (NUMBERS, PAGE))
    found = json.loads(numbers) if numbers else {}
    rows = found.get("fidelity") or fidelity_rows(page)
    with tempfile.TemporaryDirectory() as name:
        packed = subprocess.run(["git", "archive", revision], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as files:
            files.extractall(name, filter="data")
        if not (Path(name) / "benchmarks" / "clone_speed.py").exists():
            raise SystemExit(
                f"--against {revision}: this commit cannot time itself yet; name one with benchmarks/clone_speed.py"
            )
        pairs = by_turns((Side(Path(name)), Side()))
    return {
        "commit": commit,
        "date": date,
        "pairs": pairs,
        "fidelity": rows,
        "values": {**bars.values(found), **bars.fidelity_values(rows)},
    }


def _file(revision: str, path: str) -> str:
    """A file of a commit; empty where it had none."""
    done = subprocess.run(["git", "show", f"{revision}:{path}"], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"--against: {done.stderr.strip()}; name a commit of this repository")
    return done.stdout


def fidelity_rows(page: str) -> list[dict[str, Any]]:
    """The rows behind a page's table of fidelity, for states that kept them nowhere else."""
    from benchmarks.fidelity import DOCUMENTED

    keys = {title: key for key, title in DOCUMENTED.items()}
    rows: dict[tuple[str, str, bool], dict[str, Any]] = {}
    names: Sequence[str] = ()
    key = ""
    for line in page.partition("<!-- fidelity -->")[2].partition("<!-- end fidelity -->")[0].splitlines():
        cells = [c.strip() for c in line.strip("|").split("|")]
        if "phenotype_a" in cells:
            names = cells[1:]
        elif cells[0].startswith("**"):
            key = keys.get(cells[0].strip("*"), "")
        elif key and len(cells) == len(names) + 1:
            backend, _, published = cells[0].partition(", ")
            for name, cell in zip(names, cells[1:], strict=True):
                where = {"target": name, "backend": backend, "published": bool(published)}
                row = rows.setdefault((name, backend, bool(published)), where)
                if cell not in ("-", ""):
                    row[key] = float(cell)
    return list(rows.values())


def changed_fidelity(
    then: Sequence[Mapping[str, Any]], now: Sequence[Mapping[str, Any]], least: float
) -> list[dict[str, Any]]:
    """Measures that moved by at least so much, default modes, the largest change first.

    Nothing in them depends on the machine, so every difference is one of the product.
    """
    before = {(r["target"], r["backend"], r["published"]): r for r in then}
    found = []
    for row in now:
        old = before.get((row["target"], row["backend"], row["published"]))
        if old is None or row["published"]:
            continue
        for key in (k for k in row if k in old and isinstance(row[k], float)):
            if abs(row[key] - old[key]) >= least:
                where = {"target": row["target"], "backend": row["backend"], "measure": key}
                found.append({**where, "then": old[key], "now": row[key]})
    return sorted(found, key=lambda r: -abs(r["now"] - r["then"]))
