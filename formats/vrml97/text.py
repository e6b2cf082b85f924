"""From the bytes of a VRML or BT file to its text: gzip by content, UTF-8 or Latin-1, any line ends."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from fba.errors import InputFileError
from fba.findings import Finding
from formats.files import read_bytes, write_bytes

MAX_TEXT = 256 << 20
"""Bytes of text that are read at most, after decompression: about 8 million vertices, bounds gzip bombs."""

_SMALL_TEXT, _MOST_PACKED = 16 << 20, 100
"""Text beyond so many bytes that was packed to less than a hundredth is a trap, no scene; faces pack to a third."""

_GZIP = b"\x1f\x8b"

_GZIP_LEVEL = 5
"""Half the time of level 6 and 1.5 % larger, measured on clones."""


def read_text(path: Path) -> tuple[str, list[Finding]]:
    """Read a text file, compressed or not, whatever its name says.

    Returns
    -------
    text : with LF as line end and without byte order mark.
    findings : what was unusual and how it was understood.

    Raises
    ------
    InputFileError
        If the file is missing, empty, cut off, too large, or not text.
    """
    data = read_unpacked(path)
    findings: list[Finding] = []
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputFileError(f"{path} is UTF-16 text; VRML97 is UTF-8: save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        text = data.decode("latin-1")
        line = data.count(b"\n", 0, error.start) + 1
        findings.append(
            Finding(
                "warning", "encoding", f"byte {data[error.start]:#04x} is not UTF-8; read as Latin-1", f"line {line}"
            )
        )
    return text.replace("\r\n", "\n").replace("\r", "\n"), findings


def read_unpacked(path: Path) -> bytes:
    """Bytes of a text file, unpacked if they are gzip data.

    Raises
    ------
    InputFileError
        If the file is missing, empty, cut off or too large.
    """
    data = read_bytes(path, MAX_TEXT)
    return _gunzip(data, path) if data.startswith(_GZIP) else data


def write_text(text: str, path: Path) -> None:
    """Write UTF-8 text atomically, compressed where the name ends in .gz, .wrz or .x3dz; same text, same bytes."""
    data = text.encode("utf-8")
    if path.name.lower().endswith((".gz", ".wrz", ".x3dz")):
        data = gzip.compress(data, compresslevel=_GZIP_LEVEL, mtime=0)
    write_bytes(path, data)


def _gunzip(data: bytes, path: Path) -> bytes:
    parts: list[bytes] = []
    size = 0
    limit = min(MAX_TEXT, max(_SMALL_TEXT, _MOST_PACKED * len(data)))
    while data.startswith(_GZIP):
        reader = zlib.decompressobj(wbits=31)
        try:
            part = reader.decompress(data, limit - size + 1)
        except zlib.error as error:
            raise InputFileError(f"{path} is damaged gzip data ({error}); get the file again") from None
        size += len(part)
        if size > limit:
            raise InputFileError(f"{path} unpacks to more than {limit >> 20} MiB, which is not read")
        if not reader.eof:
            raise InputFileError(f"{path} is cut off: the gzip data ends early; get the file again")
        parts.append(part)
        data = reader.unused_data
    return b"".join(parts)
