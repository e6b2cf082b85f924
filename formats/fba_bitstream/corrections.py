"""What the steps of a bitstream round away, as user data: decoders that do not know it pass over it.

The 5 bits of a range bound a level by 1860, so no scale sends a head that turns far and in units at once. Behind a
magic word follow, frame by frame, the number of corrected values and for each its place (as a distance from the one
before) and the correction, positive at 2 n, negative at 2 n - 1. A number is sent in groups of 6 bits, lowest first;
each byte has its highest bit set, so that no start code can appear, and the next one where another group follows.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from fba.errors import FapStreamError

MAGIC = b"FAP corrections 1\n"
_MARK, _MORE, _BITS = 0x80, 0x40, 6
_LONGEST = 6
"""Groups of a number at most: 36 bits."""

Corrections = Mapping[int, int]
"""Column of a frame's values -> what must be added to it."""


def packed(frames: Iterable[Corrections]) -> bytes:
    """User data with the corrections of all frames."""
    out = bytearray(MAGIC)
    for frame in frames:
        put_number(out, len(frame))
        last = 0
        for place in sorted(frame):
            amount = frame[place]
            put_number(out, place - last)
            put_number(out, 2 * amount if amount >= 0 else -2 * amount - 1)
            last = place
    return bytes(out)


def unpacked(data: bytes, source: str) -> list[dict[int, int]] | None:
    """The corrections of each frame; None for user data of another kind.

    Raises
    ------
    FapStreamError
        If the data is damaged or cut.
    """
    if not data.startswith(MAGIC):
        return None
    numbers = _numbers(data[len(MAGIC) :], source)
    frames: list[dict[int, int]] = []
    for count in numbers:
        frame: dict[int, int] = {}
        place = 0
        for _ in range(count):
            distance, code = next(numbers, None), next(numbers, None)
            if distance is None or code is None:
                raise _damaged(source)
            place += distance
            frame[place] = code // 2 if code % 2 == 0 else -(code + 1) // 2
        frames.append(frame)
    return frames


def put_number(out: bytearray, number: int) -> None:
    """Append a number from 0."""
    while True:
        rest = number >> _BITS
        out.append(_MARK | (_MORE if rest else 0) | (number & (_MORE - 1)))
        if not rest:
            return
        number = rest


def _numbers(data: bytes, source: str) -> Iterator[int]:
    number = shift = 0
    for byte in data:
        if not byte & _MARK or shift == _BITS * _LONGEST:
            raise _damaged(source)
        number |= (byte & (_MORE - 1)) << shift
        shift += _BITS
        if not byte & _MORE:
            yield number
            number = shift = 0
    if shift:
        raise _damaged(source)


def _damaged(source: str) -> FapStreamError:
    return FapStreamError(f"{source}: the corrections in the user data are damaged; remove them or get the file again")
