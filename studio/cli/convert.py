"""``fba convert``: turn a stream into another kind of stream."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from studio.cli.arguments import StreamPath, StreamRate
from studio.cli.outcome import usage


def convert(
    stream: StreamPath,
    output: Annotated[Path, typer.Argument(help="Where to write: .fap, .fba (experimental) or .csv (ARKit curves).")],
    rate: StreamRate = None,
    quantizer: Annotated[
        int | None,
        typer.Option(min=0, max=31, help=".fba: scale of the quantizer; default: nothing is lost."),
    ] = None,
    open_jaw: Annotated[
        Literal["strict", "practical"],
        typer.Option(help="ARKit curves: for a face whose FAP 3 leaves the lips (strict) or opens the mouth."),
    ] = "practical",
) -> None:
    """Turn a stream (.fap, .fba, ARKit .csv, Rhubarb .json or .tsv, animated .bt or .xmt) into .fap, .fba or .csv."""
    from formats.streams import ARKIT_CURVES, FBA_BITSTREAM, stream_format, write_stream
    from studio.cli.console import console, print_findings
    from studio.streams import open_stream

    kind = stream_format(output, writing=True)
    if quantizer is not None and kind is not FBA_BITSTREAM:
        usage(f"--quantizer goes with .fba; {output} is written as {kind.name}")
    if open_jaw == "strict" and kind is ARKIT_CURVES:
        usage("--open-jaw strict is for reading ARKit curves; they are written for faces that open the mouth")
    found, findings = open_stream(stream, rate, strict_jaw=open_jaw == "strict")
    said = write_stream(found, output, quantizer)
    out = console()
    print_findings([*findings, *said], out)
    out.print(f"{output}: {kind.name}, {len(found)} frames at {found.frame_rate:g}/s")
