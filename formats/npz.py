"""NumPy archives whose bytes depend on nothing but the arrays in them."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formats.files import atomic_output

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip file can state: numpy's own writer puts the clock's time there."""


def write_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays compressed, in the order given, atomically.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    with (
        atomic_output(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=4) as out,
    ):
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.lib.format.write_array(buffer, np.asanyarray(array), allow_pickle=False)
            out.writestr(zipfile.ZipInfo(f"{name}.npy", EPOCH), buffer.getbuffer(), zipfile.ZIP_DEFLATED)
