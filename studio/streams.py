"""Streams as people name them on the command line."""

from __future__ import annotations

from pathlib import Path

from fba.errors import FapStreamError
from fba.findings import Finding
from fba.stream import FapStream
from formats.streams import ARKIT_CURVES, MOUTH_CUES, read_stream, stream_format

SHIPPED = ("demo", "every_fap")


def shipped(path: Path) -> Path:
    """The path of a shipped stream where its name is given, else the path itself."""
    if str(path) not in SHIPPED:
        return path
    from samples import sample

    return sample(f"streams/{path}.fap")


def open_stream(path: Path, rate: float | None = None, *, strict_jaw: bool = False) -> tuple[FapStream, list[Finding]]:
    """Read a stream of any kind; "demo" and "every_fap" name the shipped ones.

    Raises
    ------
    FapStreamError
        If a rate is given for a stream that tells its own, or the file is damaged.
    """
    path = shipped(path)
    kind = stream_format(path)
    if rate is not None and kind not in (ARKIT_CURVES, MOUTH_CUES):
        raise FapStreamError(f"{path}: {kind.name} tells its own frame rate; leave --rate out")
    return read_stream(path, rate, strict_jaw=strict_jaw)
