"""FAP streams: frames of FAP values, visemes and expressions at a frame rate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bools, Ints, frozen
from fba.errors import FapStreamError
from fba.faps import FAP_COUNT

VISEME_FIELDS = ("viseme_select1", "viseme_select2", "viseme_blend", "viseme_def")
EXPRESSION_FIELDS = (
    "expression_select1",
    "expression_intensity1",
    "expression_select2",
    "expression_intensity2",
    "init_face",
    "expression_def",
)


@dataclass(frozen=True, eq=False)
class FapStream:
    """A FAP animation.

    Attributes
    ----------
    frame_rate : frames per second.
    values : (frames, 68) int32; column k is FAP k+1 in FAP units. Columns 0 and 1 (FAP 1 and 2) are zero:
        their fields are in `visemes` and `expressions`. Unmasked entries are zero.
    mask : (frames, 68) bool; the FAPs that the stream speaks of in that frame.
    visemes : (frames, 4) int32, fields as in VISEME_FIELDS.
    expressions : (frames, 6) int32, fields as in EXPRESSION_FIELDS.
    frame_numbers : (frames,) int32, increasing; gaps are frames that the file does not hold.
    """

    frame_rate: float
    values: Ints
    mask: Bools
    visemes: Ints
    expressions: Ints
    frame_numbers: Ints
    name: str = "stream"
    version: str = "2.1"

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "values", frozen(self.values, np.int32, (-1, FAP_COUNT)))
        put(self, "mask", frozen(self.mask, np.bool_, (-1, FAP_COUNT)))
        put(self, "visemes", frozen(self.visemes, np.int32, (-1, len(VISEME_FIELDS))))
        put(self, "expressions", frozen(self.expressions, np.int32, (-1, len(EXPRESSION_FIELDS))))
        put(self, "frame_numbers", frozen(self.frame_numbers, np.int32, (-1,)))
        counts = {
            len(self.values),
            len(self.mask),
            len(self.visemes),
            len(self.expressions),
            len(self.frame_numbers),
        }
        if len(counts) != 1:
            raise FapStreamError(f"the arrays of a FAP stream have different numbers of frames: {sorted(counts)}")
        if not (np.isfinite(self.frame_rate) and self.frame_rate > 0):
            raise FapStreamError(f"the frame rate must be a positive number, not {self.frame_rate}")

    def __len__(self) -> int:
        return len(self.values)

    def held(self) -> FapStream:
        """Return the stream with every FAP kept at its last value in frames that do not speak of it.

        The public players differ: some take such a FAP for neutral (so does this toolkit), some keep the last value,
        which is what this gives them. FAPs stay unmasked until their first value.
        """
        rows = np.arange(len(self))[:, None]
        last = np.maximum.accumulate(np.where(self.mask, rows, -1), axis=0)
        at = np.maximum(last, 0)
        columns = np.arange(FAP_COUNT)
        return replace(
            self,
            values=np.where(last >= 0, self.values[at, columns], 0),
            mask=last >= 0,
            visemes=np.where(last[:, :1] >= 0, self.visemes[at[:, 0]], 0),
            expressions=np.where(last[:, 1:2] >= 0, self.expressions[at[:, 1]], 0),
        )

    @classmethod
    def build(
        cls,
        frame_rate: float,
        frames: int,
        faps: dict[int, object] | None = None,
        visemes: object | None = None,
        expressions: object | None = None,
        name: str = "stream",
    ) -> FapStream:
        """Build a stream from FAP number -> (frames,) values, and optional (frames, 4) and (frames, 6) fields."""
        values = np.zeros((frames, FAP_COUNT), dtype=np.int32)
        mask = np.zeros((frames, FAP_COUNT), dtype=bool)
        for number, column in (faps or {}).items():
            values[:, number - 1] = np.rint(np.asarray(column, dtype=np.float64))
            mask[:, number - 1] = True
        high = []
        for k, fields, width in ((0, visemes, 4), (1, expressions, 6)):
            mask[:, k] = fields is not None
            high.append(np.zeros((frames, width), np.int32) if fields is None else np.asarray(fields, np.int32))
        return cls(frame_rate, values, mask, high[0], high[1], np.arange(frames, dtype=np.int32), name)
