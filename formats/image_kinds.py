"""What kind of image some bytes are, and whether it has holes."""

from __future__ import annotations

import struct

_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"


def image_type(data: bytes) -> str | None:
    """The media type of an image that glTF can hold (PNG, JPEG; WebP by an extension), else None."""
    if data.startswith(_PNG):
        return "image/png"
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return "image/webp"
    return "image/jpeg" if data.startswith(_JPEG) else None


def has_alpha(data: bytes) -> bool:
    """True for a PNG with an alpha channel or a transparent colour."""
    if not data.startswith(_PNG) or len(data) < 33:
        return False
    if data[25] in (4, 6):
        return True
    at = 8
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind in (b"tRNS", b"IDAT"):
            return bool(kind == b"tRNS")
        at += 12 + length
    return False
