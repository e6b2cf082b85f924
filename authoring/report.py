"""What an authoring run did: for each FAP, viseme and expression what it was made from, ready for JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

from fba.findings import Finding

How = Literal["given", "units", "constructed", "posed", "rigged"]


@dataclass(frozen=True)
class Step:
    """One border of a table.

    Attributes
    ----------
    value : of the FAP.
    how : "given" by a shape, made of "units", "constructed", "posed" of other FAPs, or "rigged" as a rotation.
    parts : shape -> factor, or FAP name -> value for poses.
    """

    value: int
    how: How
    parts: Mapping[str, float]


@dataclass(frozen=True)
class Entry:
    """One FAP, viseme or expression.

    Attributes
    ----------
    steps : what its table is made of; none = it is missing.
    why : why it is missing, or why units or a side were not used.
    error : what the own feature point misses on the finished face where it is worst, in FAP units; None where
        nothing measures it.
    """

    fap_id: int
    select: int
    name: str
    steps: tuple[Step, ...]
    why: str
    error: float | None

    @property
    def missing(self) -> bool:
        return not self.steps


@dataclass(frozen=True)
class AuthorReport:
    """The record of one authored source.

    Attributes
    ----------
    open_jaw : "practical" or "strict", as the finished tables have it; "" without a jaw.
    used : shape -> what it was taken for.
    ignored : shape -> why it was not used.
    """

    face: str
    open_jaw: str
    entries: tuple[Entry, ...]
    used: Mapping[str, str]
    ignored: Mapping[str, str]
    unknown: tuple[str, ...]
    findings: tuple[Finding, ...]
    timings: Mapping[str, float]

    def made(self, how: How) -> tuple[Entry, ...]:
        """The entries of which at least one step was made this way."""
        return tuple(e for e in self.entries if any(step.how == how for step in e.steps))

    @property
    def missing(self) -> tuple[Entry, ...]:
        return tuple(e for e in self.entries if e.missing)

    def to_dict(self) -> dict[str, object]:
        """Everything as plain dicts, lists, strings and numbers."""
        return asdict(self)

    def to_json(self) -> str:
        """The report as a JSON document."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False)
