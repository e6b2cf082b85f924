"""What a cloning run did, in numbers and plain words, ready for JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from cloning.kinds import Part
from fba.findings import Finding


@dataclass(frozen=True)
class CloneReport:
    """The record of one clone.

    Attributes
    ----------
    backend : name of the backend, e.g. "fmc".
    as_published : True for the paper's own method.
    source, target : names of the two faces.
    motions : number of motions cloned.
    measures : name -> number; see the backend for their meaning.
    parameters : what the run was made with.
    findings : every step that fell short, in plain words.
    timings : stage -> seconds.
    parts : what each piece of the target is, and how it moves.
    """

    backend: str
    as_published: bool
    source: str
    target: str
    motions: int
    measures: Mapping[str, float]
    parameters: Mapping[str, float | str | bool]
    findings: tuple[Finding, ...]
    timings: Mapping[str, float]
    parts: tuple[Part, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Everything as plain dicts, lists, strings and numbers."""
        return {
            "backend": self.backend,
            "as_published": self.as_published,
            "source": self.source,
            "target": self.target,
            "motions": self.motions,
            "measures": dict(self.measures),
            "parameters": dict(self.parameters),
            "findings": [
                {"severity": f.severity, "code": f.code, "message": f.message, "where": f.where} for f in self.findings
            ],
            "timings": dict(self.timings),
            "parts": [part.to_dict() for part in self.parts],
        }

    def to_json(self) -> str:
        """The report as a JSON document."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False)

    def warnings(self) -> tuple[Finding, ...]:
        """Findings that are more than information."""
        return tuple(f for f in self.findings if f.severity != "info")
