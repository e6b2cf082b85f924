"""What may stand around the FBA object: the headers of a visual object sequence, and user data in them.

The start codes and header fields are those of all MPEG-4 visual streams (ISO/IEC 14496-2, 6.2.2), which many public
players of video read.
"""

from __future__ import annotations

from fba.errors import FapStreamError, UnsupportedFeatureError
from formats.fba_bitstream.bits import BitWriter
from formats.fba_bitstream.syntax import OBJECT_STARTS

SEQUENCE_START, USER_DATA, VISUAL_OBJECT = 0x1B0, 0x1B2, 0x1B5
_FBA_TYPE = 4
"""visual_object_type of faces and bodies; 1 is video, 2 a still texture, 3 a mesh."""
_PROFILE = 0x62
"""Simple face animation, level 2."""
_PREFIX = b"\0\0\1"


def wrapped(fba_object: bytes, user_data: bytes) -> bytes:
    """A whole sequence around an FBA object with its end code.

    user_data : must not hold the bytes of a start code.
    """
    out = BitWriter()
    out.bits(SEQUENCE_START, 32)
    out.bits(_PROFILE, 8)
    head = out.bytes() + USER_DATA.to_bytes(4, "big") + user_data
    out = BitWriter()
    out.bits(VISUAL_OBJECT, 32)
    out.bit(0)
    out.bits(_FBA_TYPE, 4)
    out.bits(0b011, 3)  # up to the byte boundary
    return head + out.bytes() + fba_object


def unwrapped(data: bytes, source: str) -> tuple[int, list[bytes]]:
    """Where the FBA object's start code stands, and the user data before it.

    Raises
    ------
    FapStreamError
        If there is no FBA object.
    UnsupportedFeatureError
        If the sequence holds something else, such as video.
    """
    at, found = 0, list[bytes]()
    while data.startswith(_PREFIX, at):
        code = int.from_bytes(data[at : at + 4], "big")
        if code in OBJECT_STARTS:
            return at, found
        end = data.find(_PREFIX, at + 4)
        content = data[at + 4 : end if end >= 0 else len(data)]
        if code == USER_DATA:
            found.append(content)
        elif code == VISUAL_OBJECT:
            _require_fba(content, source, at)
        elif code != SEQUENCE_START:
            break
        at = end if end >= 0 else len(data)
    raise FapStreamError(
        f"{source}, byte {at}, bit 0: there is no FBA object start code (00 00 01 BA); this is no FBA bitstream"
    )


def _require_fba(content: bytes, source: str, at: int) -> None:
    head = int.from_bytes(content[:2].ljust(2, b"\0"), "big")
    kind = head >> 4 & 15 if head >> 15 else head >> 11 & 15
    if kind != _FBA_TYPE:
        raise UnsupportedFeatureError(
            f"{source}, byte {at}: the sequence holds a visual object of type {kind}; only faces (type 4) are read"
        )
