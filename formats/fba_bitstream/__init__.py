"""The binary FBA bitstream of ISO/IEC 14496-2: the face, predictive mode. Experimental.

Written from published descriptions of one other coder; neither the standard's text nor files of other coders were at
hand. docs/formats/streams.md says what is certain and what is a reading.
"""

from __future__ import annotations

from pathlib import Path

from fba.errors import FapStreamError
from fba.findings import Finding
from fba.stream import FapStream
from formats.fap import range_findings
from formats.fba_bitstream.corrections import packed
from formats.fba_bitstream.decoder import Decoder
from formats.fba_bitstream.encoder import Encoder
from formats.fba_bitstream.remarks import correction_findings, lossy_findings
from formats.fba_bitstream.sequence import wrapped
from formats.files import read_bytes, write_bytes

__all__ = ["decode_fba", "encode_fba", "read_fba", "write_fba"]

LARGEST_FILE = 64 << 20
"""Bytes; days of animation."""

EXPERIMENTAL = Finding(
    "info", "experimental", "FBA bitstreams are experimental: read and written alike, but not tried with other coders"
)


def read_fba(path: str | Path) -> tuple[FapStream, list[Finding]]:
    """Read a .fba file.

    Returns
    -------
    stream : named after the file; a FAP that a frame does not send is unmasked there.
    findings : what is unusual.

    Raises
    ------
    InputFileError
        If the file cannot be read.
    FapStreamError
        If it is damaged; the message names the byte and bit.
    UnsupportedFeatureError
        If it is coded in DCT mode or animates a body.
    """
    path = Path(path)
    return decode_fba(read_bytes(path, LARGEST_FILE), str(path), path.stem)


def decode_fba(data: bytes, source: str = "stream", name: str = "stream") -> tuple[FapStream, list[Finding]]:
    """Read the bytes of an FBA bitstream; `source` names them in messages. See `read_fba`."""
    stream, found = Decoder(data, source).decode(name)
    return stream, [EXPERIMENTAL, *found, *range_findings(stream)]


def write_fba(stream: FapStream, path: str | Path, quantizer: int | None = None) -> list[Finding]:
    """Write a .fba file atomically; see `encode_fba`."""
    data, found = encode_fba(stream, quantizer)
    write_bytes(path, data)
    return found


def encode_fba(stream: FapStream, quantizer: int | None = None) -> tuple[bytes, list[Finding]]:
    """Code a stream.

    Parameters
    ----------
    quantizer : scale 0..31. 0 sends values as they are, which holds as long as they stay within 1860 of zero, or later
        of the frame before; otherwise values are rounded to multiples of the scale times the FAP's own step. None
        loses nothing: it takes 0 where that is exact, else 1 and puts what is rounded away into user data.

    Returns
    -------
    data : the bitstream.
    findings : what was rounded or cut, or stands in user data.

    Raises
    ------
    FapStreamError
        If the stream has no frames, or more than 100,000 are missing in one place.
    UnsupportedFeatureError
        If the frame rate cannot be coded.
    """
    if not len(stream):
        raise FapStreamError(f"the stream '{stream.name}' has no frames; an FBA bitstream needs at least one")
    if quantizer is not None and not 0 <= quantizer <= 31:
        raise FapStreamError(f"the scale of the quantizer must be 0 to 31, not {quantizer}")
    plain = Encoder(stream, quantizer or 0)
    if quantizer is not None or plain.exact:
        return plain.encode(), [EXPERIMENTAL, *lossy_findings(plain, stream, quantizer or 0)]
    rounded = Encoder(stream, 1)
    data = wrapped(rounded.encode(), packed(rounded.corrections()))
    return data, [EXPERIMENTAL, *correction_findings(plain, rounded, stream)]
