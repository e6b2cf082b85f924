"""NumPy archives: written so that their bytes depend on nothing but the arrays, and read with care."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fba.errors import FbaError, InputFileError
from formats.files import atomic_output, read_bytes

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip file can state: numpy's own writer puts the clock's time there."""

MOST_BYTES = 4 << 30
"""Larger archives, packed or unpacked, are not read: 88 targets of a face of 1,000,000 vertices need half of it."""


def read_npz(path: Path, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read arrays of plain numbers and text.

    Parameters
    ----------
    names : the arrays wanted; those that the archive lacks are not in the result.

    Raises
    ------
    InputFileError
        If the file is missing, damaged, too large, or holds Python objects.
    """
    data = read_bytes(path, MOST_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MOST_BYTES:
                raise InputFileError(f"{path} unpacks to more than {MOST_BYTES} bytes, which are not read")
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: np.asarray(arrays[name]) for name in names if name in arrays}
    except FbaError:
        raise
    except Exception as error:
        # Damaged archives make zipfile, zlib, numpy and its header parser fail each in their own way.
        raise InputFileError(f"{path} is not a readable .npz file: {str(error)[:120]}") from None


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
