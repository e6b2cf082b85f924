"""The tables of ``docs/profiles.md``, in words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from fba.errors import InputFileError
from fba.faps import fap
from formats.files import write_bytes
from samples.build.arkit_anatomy import OUTER_CORNER

Row = Mapping[str, str]

FACES = {"makehuman": "MakeHuman", "ict": "ICT-FaceKit", "rpm": "Ready Player Me"}


def put_tables(path: Path, tables: Mapping[str, str]) -> None:
    """Replace what stands between ``<!-- NAME -->`` and ``<!-- end NAME -->``.

    Raises
    ------
    InputFileError
        If a pair of marks is missing.
    """
    text = path.read_text("utf-8")
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
        before, opened, rest = text.partition(begin)
        _, closed, after = rest.partition(end)
        if not (opened and closed):
            raise InputFileError(
                f"{path} has no place for the table '{name}'; add <!-- {name} --> and <!-- end {name} -->"
            )
        text = before + begin + table + end + after
    write_bytes(path, text.encode())


def forward_table(rows: Iterable[Row]) -> str:
    """ARKit's shapes in words; the right side, mirrored, is left out."""
    rows = [row for row in rows if not row["shape"].endswith("Right")]
    faces = [face for face in FACES if any(row.get(f"{face}_dense") for row in rows)]
    lines = [_line("shape", "FAPs at weight 1", *(FACES[face] for face in faces))]
    lines.append("|---|---|" + "---|" * len(faces) + "\n")
    lines += [_line(row["shape"], in_words(row["faps"]), *(_residual(row, face) for face in faces)) for row in rows]
    return "".join(lines)


def backward_table(rows: Iterable[Row]) -> str:
    """FAPs in shapes of ARKit; FAPs of the right side are left out."""
    lines = [_line("FAP", "value", "shapes, percent", "residuals", "note"), "|---|---|---|---|---|\n"]
    for row in rows:
        number = int(row["fap"])
        if (fap(number).mirror or number) >= number:
            shapes = ", ".join(part.replace(":", " ") for part in row["percent"].split())
            cells = (f"{number} {row['name']}", row["value"], shapes, _residual(row, "makehuman"), row["note"])
            lines.append(_line(*cells))
    return "".join(lines)


def in_words(faps: str) -> str:
    """FAPs with their names; those of one name and value together.

    >>> in_words("12:600 13:600 59:600 60:600 41:-3")
    '12 13 59 60 raise_cornerlip 600, 41 lift_l_cheek -3'
    """
    values = {int(n): int(v) for n, v in (part.split(":") for part in faps.split())}
    groups: dict[tuple[int, int], list[int]] = {}
    for number, value in values.items():
        inner = {outer: k for k, outer in OUTER_CORNER.items()}.get(number, number)
        groups.setdefault((min(inner, fap(inner).mirror or inner), value), []).append(number)
    return ", ".join(f"{' '.join(map(str, g))} {_name(g)} {value}" for (_, value), g in groups.items())


def _name(numbers: list[int]) -> str:
    """One name for FAPs that are mirror images or inner and outer corner."""
    name = fap(numbers[0]).name
    if not any(fap(k).mirror in numbers for k in numbers):
        return name
    return re.sub(r"_lip_[lr]m", "_lip_m", re.sub(r"_[lr]_", "_", name, count=1))


def _residual(row: Row, face: str) -> str:
    point, dense = row.get(f"{face}_fp"), row.get(f"{face}_dense")
    return f"{point} / {dense}" if dense else ""


def _line(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |\n"
