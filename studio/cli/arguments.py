"""Arguments that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

FacePath = Annotated[Path, typer.Argument(help="A face file; the word 'default' names the shipped source face.")]
OutPath = Annotated[Path, typer.Option("--output", "-o", help="Where to write; the extension chooses the format.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document, nothing else.")]
StreamPath = Annotated[
    Path,
    typer.Argument(
        help="A stream: .fap, .fba, ARKit curves (.csv), Rhubarb cues (.json, .tsv), the updates of an animated .bt or "
        ".xmt; 'demo' and 'every_fap' name the shipped ones."
    ),
]
StreamRate = Annotated[
    float | None,
    typer.Option(
        "--rate", help="Frames a second of mouth cues (default 50) or of curves (default: as their time codes tell)."
    ),
]

OpenJaw = Annotated[
    Literal["strict", "practical"] | None,
    typer.Option(help="FAP 3 leaves the lips as the standard has it (strict), or opens the mouth (practical)."),
]


def parse_faps(text: str) -> tuple[int, ...]:
    """Turn "3,5,12-14,open_jaw" into FAP numbers.

    Raises
    ------
    ValueError
        If a part is neither a FAP number, a range nor a FAP name, or there is no part.

    >>> parse_faps("3,12-14")
    (3, 12, 13, 14)
    """
    from fba.faps import fap

    numbers: list[int] = []
    for part in filter(None, (p.strip() for p in text.split(","))):
        low, dash, high = part.partition("-")
        if dash and low.isdecimal() and high.isdecimal():
            if int(high) < int(low):
                raise ValueError(f"the FAPs {part} run backwards; write {high}-{low}")
            numbers += range(int(low), int(high) + 1)
        else:
            numbers.append(int(part) if part.isdecimal() else _by_name(part))
    for number in numbers:
        try:
            fap(number)
        except KeyError as error:
            raise ValueError(str(error.args[0])) from None
    if not numbers:
        raise ValueError("no FAP is named; write numbers, ranges or names such as 3,12-14,open_jaw")
    return tuple(dict.fromkeys(numbers))


def parse_rules(text: str) -> tuple[str, ...]:
    """Turn "all", "none" or "corners,lids" into combination rules.

    Raises
    ------
    ValueError
        If a rule is unknown, or none is named.

    >>> parse_rules("lids,corners"), parse_rules("none")
    (('corners', 'lids'), ())
    """
    from fat.combine import RULES, chosen_rules
    from fba.errors import FapStreamError

    names = [part for part in (p.strip() for p in text.split(",")) if part]
    if names == ["all"]:
        return RULES
    if names == ["none"]:
        return ()
    if not names:
        raise ValueError(f"no rule is named; write all, none, or some of {', '.join(RULES)}")
    try:
        return chosen_rules(names)
    except FapStreamError as error:
        raise ValueError(f"{error}; or write all or none") from None


def _by_name(name: str) -> int:
    from fba.faps import fap

    try:
        return fap(name).id
    except KeyError:
        raise ValueError(f"'{name}' is neither a FAP number nor the name of a FAP") from None
