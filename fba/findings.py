"""Findings: what is worth telling a person about a face, a table or a stream, without stopping the work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "info"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing found by a check.

    Attributes
    ----------
    severity : "error" (does not work), "warning" (works, but not as one would expect) or "info".
    code : short, stable, machine-readable name, e.g. ``lip-gap``.
    message : what is wrong in plain words, with numbers, and what to do about it.
    where : the shape, FAP, line or point that it is about; empty for the whole face.
    """

    severity: Severity
    code: str
    message: str
    where: str = ""
