"""Reading and writing single bits, most significant first."""

from __future__ import annotations

from fba.errors import FapStreamError


class BitReader:
    """A place in a string of bits.

    Attributes
    ----------
    position : number of the next bit.
    size : number of bits there are.
    """

    def __init__(self, data: bytes, source: str) -> None:
        self._data = data
        self._source = source
        self.size = 8 * len(data)
        self.position = 0

    def bit(self) -> int:
        """Next bit.

        Raises
        ------
        FapStreamError
            At the end of the data.
        """
        at = self.position
        if at >= self.size:
            raise self.error("the file ends here, in the middle of a frame; it is cut or damaged")
        self.position = at + 1
        return self._data[at >> 3] >> (7 - (at & 7)) & 1

    def bits(self, count: int) -> int:
        """Next bits as a number."""
        value = 0
        for _ in range(count):
            value = value << 1 | self.bit()
        return value

    def bit_at(self, position: int) -> int:
        """A bit anywhere; 0 behind the end."""
        return self._data[position >> 3] >> (7 - (position & 7)) & 1 if position < self.size else 0

    def word_at(self, position: int) -> int | None:
        """The 32 bits at a byte boundary; None where there are fewer."""
        start = position >> 3
        return int.from_bytes(self._data[start : start + 4], "big") if start + 4 <= len(self._data) else None

    def marker(self, where: str) -> None:
        """Pass a bit that is always 1."""
        if not self.bit():
            self.position -= 1
            raise self.error(f"the marker bit {where} is 0; this is not an FBA bitstream, or it is damaged")

    def error(self, message: str) -> FapStreamError:
        """An error that names the byte and bit."""
        return FapStreamError(f"{self._source}, byte {self.position >> 3}, bit {self.position & 7}: {message}")


class BitWriter:
    """Bits that become bytes."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._last = 0
        self._count = 0

    def bit(self, value: int) -> None:
        """Append one bit."""
        self._last = self._last << 1 | (value & 1)
        self._count += 1
        if self._count == 8:
            self._data.append(self._last)
            self._last = self._count = 0

    def bits(self, value: int, count: int) -> None:
        """Append a number in so many bits."""
        for shift in range(count - 1, -1, -1):
            self.bit(value >> shift)

    def start_code(self, code: int) -> None:
        """Append a start code at a byte boundary: one 0, then 1s up to it (a whole byte where it is there already)."""
        if self._data or self._count:
            self.bit(0)
            while self._count:
                self.bit(1)
        self.bits(code, 32)

    def bytes(self) -> bytes:
        """All whole bytes; start codes end on one."""
        return bytes(self._data)
