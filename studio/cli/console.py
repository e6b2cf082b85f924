"""What the verbs print: plain text that pipes well, tables, findings, JSON, and progress on a terminal."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from fba.findings import Finding

MARKS = {"error": "ERROR", "warning": "warning", "info": "note"}
STYLES = {"error": "bold red", "warning": "yellow", "info": "dim"}

Report = Callable[[str, float], None]


def console() -> Console:
    """A console on stdout; wide when it is not a terminal, so that lines are not folded in files."""
    return Console(width=None if sys.stdout.isatty() else 200, highlight=False)


def print_json(document: object) -> None:
    """One JSON document on stdout, nothing else."""
    print(json.dumps(document, indent=2, ensure_ascii=False))


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], out: Console) -> None:
    """Print a table; columns whose name starts with '>' are right-aligned."""
    made = Table(title=title or None, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for column in columns:
        made.add_column(column.lstrip(">"), justify="right" if column.startswith(">") else "left")
    for row in rows:
        made.add_row(*(Text(cell) for cell in row))
    out.print(made)


def print_findings(findings: Sequence[Finding], out: Console) -> None:
    """One line for each finding, errors first."""
    order = list(MARKS)
    for finding in sorted(findings, key=lambda f: order.index(f.severity)):
        where = f" [{finding.where}]" if finding.where else ""
        line = Text()
        line.append(f"{MARKS[finding.severity]}: ", style=STYLES[finding.severity])
        line.append(f"{finding.message}{where}")
        out.print(line, soft_wrap=True)


def findings_json(findings: Sequence[Finding]) -> list[dict[str, str]]:
    """Findings as plain data."""
    return [{"severity": f.severity, "code": f.code, "message": f.message, "where": f.where} for f in findings]


@contextmanager
def progress(quiet: bool = False) -> Iterator[Report]:
    """Yield ``report(stage, fraction)``: a bar on stderr where that is a terminal, silence elsewhere."""
    if quiet or not sys.stderr.isatty():
        yield lambda _stage, _fraction: None
        return
    bar = Progress(
        TextColumn("{task.description:<24}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, fraction: bar.update(task, description=stage, completed=fraction)
