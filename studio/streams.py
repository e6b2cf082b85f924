"""Streams as people name them on the command line."""

from __future__ import annotations

from pathlib import Path

from fba.errors import FapStreamError
from fba.findings import Finding
from fba.stream import FapStream
from formats.streams import ARKIT_CURVES, MOUTH_CUES, read_stream, stream_format


def open_stream(path: Path, rate: float | None = None, *, strict_jaw: bool = False) -> tuple[FapStream, list[Finding]]:
    """Read a stream of any kind; "demo" names the shipped one.

    Raises
    ------
    FapStreamError
        If a rate is given for a stream that tells its own, or the file is damaged.
    """
    if str(path) == "demo":
        from samples import sample

        path = sample("streams/demo.fap")
    kind = stream_format(path)
    if rate is not None and kind not in (ARKIT_CURVES, MOUTH_CUES):
        raise FapStreamError(f"{path}: {kind.name} tells its own frame rate; leave --rate out")
    return read_stream(path, rate, strict_jaw=strict_jaw)
