"""Which module reads and writes which kind of stream; chosen by the file's extension."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fba.errors import UnknownFormatError
from fba.findings import Finding
from fba.stream import FapStream


@dataclass(frozen=True, slots=True)
class StreamFormat:
    """A kind of stream file.

    in_faces : its files hold a face, which the stream moves.
    """

    name: str
    extensions: tuple[str, ...]
    writes: bool = True
    in_faces: bool = False


FAP_TEXT = StreamFormat("FAP text", (".fap",))
FBA_BITSTREAM = StreamFormat("FBA bitstream", (".fba",))
ARKIT_CURVES = StreamFormat("ARKit curves", (".csv",))
MOUTH_CUES = StreamFormat("Rhubarb mouth cues", (".json", ".tsv"), writes=False)
BT_UPDATES = StreamFormat("MPEG-4 BT", (".bt",), writes=False, in_faces=True)
XMTA_UPDATES = StreamFormat("MPEG-4 XMT-A", (".xmt", ".xmta"), writes=False, in_faces=True)

STREAM_FORMATS = (FAP_TEXT, FBA_BITSTREAM, ARKIT_CURVES, MOUTH_CUES, BT_UPDATES, XMTA_UPDATES)


def stream_format(path: str | Path, *, writing: bool = False) -> StreamFormat:
    """Find the kind by the file's extension.

    Raises
    ------
    UnknownFormatError
        If no kind of stream is read (written) under such a name.
    """
    suffix = Path(path).suffix.lower()
    fitting = [f for f in STREAM_FORMATS if f.writes or not writing]
    found = next((f for f in fitting if suffix in f.extensions), None)
    if found is None:
        verb = "written" if writing else "read"
        known = ", ".join(e for f in fitting for e in f.extensions)
        raise UnknownFormatError(f"{path}: streams of this kind cannot be {verb}; known extensions: {known}")
    return found


def read_stream(
    path: str | Path, rate: float | None = None, *, strict_jaw: bool = False
) -> tuple[FapStream, list[Finding]]:
    """Read any stream as FAPs.

    Parameters
    ----------
    rate : frames a second of cues and curves; the others tell their own.
    strict_jaw : curves for a face whose open_jaw leaves the lips; see `formats.arkit_csv.read_arkit_csv`.

    Raises
    ------
    UnknownFormatError
        If the extension is none of a stream.
    InputFileError, FapStreamError, UnsupportedFeatureError
        If the file cannot be read.
    """
    kind = stream_format(path)
    if kind is ARKIT_CURVES:
        from formats.arkit_csv import read_arkit_csv

        return read_arkit_csv(path, rate, strict_jaw=strict_jaw)
    if kind is MOUTH_CUES:
        from formats.rhubarb import read_rhubarb

        return read_rhubarb(path, rate)
    if kind is FBA_BITSTREAM:
        from formats.fba_bitstream import read_fba

        return read_fba(path)
    if kind is BT_UPDATES:
        from formats.bt import read_stream as read_bt

        return read_bt(Path(path))
    if kind is XMTA_UPDATES:
        from formats.xmta import read_stream as read_xmta

        return read_xmta(Path(path))
    from formats.fap import read_fap

    return read_fap(path)


def write_stream(stream: FapStream, path: str | Path, quantizer: int | None = None) -> list[Finding]:
    """Write a stream.

    quantizer : scale of an FBA bitstream; see `formats.fba_bitstream.encode_fba`.

    Returns
    -------
    findings : what the file does not carry.

    Raises
    ------
    UnknownFormatError
        If no stream is written under such a name.
    FapStreamError, UnsupportedFeatureError, OutputFileError
        If the stream cannot be written.
    """
    kind = stream_format(path, writing=True)
    if kind is ARKIT_CURVES:
        from formats.arkit_csv import write_arkit_csv

        return write_arkit_csv(stream, path)
    if kind is FBA_BITSTREAM:
        from formats.fba_bitstream import write_fba

        return write_fba(stream, path, quantizer)
    from formats.fap import write_fap

    write_fap(stream, path)
    return []
