"""Golden frames as .npz: ``neutral`` (m, 3), ``vertices`` (frames, m, 3), ``fps``, and ``ids`` (m,) where not all of a
face's vertices are kept. What ``fba play FACE STREAM -o FRAMES.npz`` writes is of the same form."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fat.golden import Golden
from fba.errors import InputFileError
from formats.npz import read_npz, write_npz

_NAMES = ("ids", "neutral", "vertices", "fps")


def read_golden(path: Path) -> Golden:
    """Read the frames of a player.

    Raises
    ------
    InputFileError
        If the file is missing, damaged or lacks an array; if the arrays do not fit each other.
    """
    arrays = read_npz(path, _NAMES)
    missing = [name for name in _NAMES[1:] if name not in arrays]
    if missing:
        raise InputFileError(
            f"{path} has no array '{missing[0]}'; neutral (m, 3), vertices (frames, m, 3) and fps are needed, and ids "
            "(m,) where these are not all vertices of the face"
        )
    neutral, vertices, fps = (arrays[name] for name in _NAMES[1:])
    ids = arrays.get("ids", np.arange(len(neutral) if neutral.ndim else 0))
    right = (
        neutral.ndim == 2
        and vertices.ndim == 3
        and vertices.shape[1:] == neutral.shape == (len(neutral), 3)
        and ids.shape == (len(neutral),)
        and fps.size == 1
        and ids.dtype.kind in "iu"
        and all(a.dtype.kind in "fiu" for a in (neutral, vertices, fps))
    )
    if not right:
        shapes = ", ".join(f"{name} {arrays[name].shape}" for name in _NAMES if name in arrays)
        raise InputFileError(
            f"{path}: the arrays do not fit each other ({shapes}); numbers are needed: neutral (m, 3), vertices "
            "(frames, m, 3), one fps, whole ids (m,)"
        )
    if ids.size and not (int(ids.min()) >= 0 and int(ids.max()) < 2**31):
        raise InputFileError(f"{path}: ids must be numbers of vertices, from 0")
    return Golden(ids, neutral, vertices, float(fps.ravel()[0]))


def write_golden(golden: Golden, path: Path) -> None:
    """Write frames in single precision, atomically; same frames, same bytes."""
    neutral, frames = golden.neutral.astype(np.float32), golden.frames.astype(np.float32)
    write_npz(path, dict(zip(_NAMES, (golden.ids, neutral, frames, np.asarray(golden.fps)), strict=True)))
