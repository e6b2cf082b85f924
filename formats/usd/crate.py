"""A first look at binary USD: OpenUSD takes the counts in a damaged .usdc at their word and asks for the memory."""

from __future__ import annotations

import struct

MAGIC = b"PXR-USDC"
_COUNTED = (b"TOKENS", b"STRINGS", b"FIELDS", b"FIELDSETS", b"PATHS", b"SPECS")
MOST_PER_BYTE = 255
"""LZ4, which packs the sections, makes at most this many bytes out of one."""


def impossible_count(data: bytes) -> str | None:
    """Say which section of a crate file claims more than its bytes can hold; None if all is possible.

    Notes
    -----
    Layout (OpenUSD, crateFile.cpp): at byte 16 the offset of the table of contents, which has a count and for each
    section a name of 16 bytes, start and size; the sections named here begin with their number of entries, tokens
    with the size of their text besides. All numbers are 64 bits, little-endian. What OpenUSD notices by itself (a
    table or section outside the file) is left to it.
    """
    if not data.startswith(MAGIC) or len(data) < 24:
        return None
    (table,) = struct.unpack_from("<q", data, 16)
    if not 0 <= table <= len(data) - 8:
        return None
    (sections,) = struct.unpack_from("<Q", data, table)
    if sections > (len(data) - table - 8) // 32:
        return f"its table of contents claims {sections} sections"
    for number in range(sections):
        name, start, size = struct.unpack_from("<16sqq", data, table + 8 + 32 * number)
        label = name.rstrip(b"\0")
        if label not in _COUNTED or not 0 <= start <= len(data) - 16:
            continue
        counts = struct.unpack_from("<QQ", data, start)
        for count in counts if label == b"TOKENS" else counts[:1]:
            if count > MOST_PER_BYTE * max(size, 0):
                return f"its section {label.decode()} claims {count} entries in {size} bytes"
    return None
