"""Array types and the helper that makes the toolkit's data read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, dtype: Any, shape: tuple[int, ...] | None = None) -> NDArray[Any]:
    """Return a C-contiguous, read-only array of this type; ``-1`` in `shape` means any length.

    The input is copied only when it is writable by somebody else or has another type.
    """
    array = np.ascontiguousarray(values, dtype=dtype)
    if shape is not None:
        array = array.reshape(shape)
    if array.flags.writeable:
        if isinstance(values, np.ndarray) and np.shares_memory(array, values):
            array = array.copy()
        array.flags.writeable = False
    return array
