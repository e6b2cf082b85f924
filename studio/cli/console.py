"""What the verbs print: plain text that pipes well, tables, findings, JSON, and progress on a terminal."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from fba.findings import Finding

MARKS = {"error": "ERROR", "warning": "warning", "info": "note"}
STYLES = {"error": "bold red", "warning": "yellow", "info": "dim"}

Report = Callable[[str, float], None]


class _PlainConsole(Console):
    """A console that leaves a reader who went away to its caller."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def console() -> Console:
    """A console on stdout; wide when it is not a terminal, so that lines are not folded in files.

    Text is printed as it is: names from files may hold anything, square brackets included.
    """
    return _PlainConsole(width=None if sys.stdout.isatty() else 200, highlight=False, markup=False, emoji=False)


def print_json(document: object) -> None:
    """One JSON document on stdout, nothing else; numbers that JSON does not know (infinity) become null."""
    print(json.dumps(_strict(document), indent=2, ensure_ascii=False, allow_nan=False))


def _strict(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
