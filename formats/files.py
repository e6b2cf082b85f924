"""Reading and writing files safely: clear errors, and outputs that are whole or absent."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fba.errors import InputFileError, OutputFileError


def read_bytes(path: str | Path, limit: int = 2 << 30) -> bytes:
    """Read a whole file.

    Raises
    ------
    InputFileError
        If it is missing, a folder, unreadable, empty, or larger than `limit` bytes.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        if path.is_dir():
            raise InputFileError(f"{path} is a folder, not a file")
        if size > limit:
            raise InputFileError(f"{path} has {size} bytes; more than {limit} are not read")
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputFileError(f"{path} does not exist; check the path") from None
    except OSError as error:
        raise InputFileError(f"{path} cannot be read: {error.strerror or error}") from error
    if not data:
        raise InputFileError(f"{path} is empty (0 bytes)")
    return data


def require_folder(path: Path) -> None:
    """Refuse an output early, before long work, when its folder is not there.

    Raises
    ------
    OutputFileError
        If the folder of `path` does not exist or is no folder.
    """
    if not path.parent.is_dir():
        raise OutputFileError(f"cannot write {path}: there is no folder {path.parent}; make it first")


@contextmanager
def atomic_output(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` (same extension); rename it onto `path` when the block succeeds.

    Raises
    ------
    OutputFileError
        If the folder does not exist or cannot be written, or the disk is full. What stood at `path` before
        is untouched then.
    """
    path = Path(path)
    folder = path.parent
    if path.is_dir():
        raise OutputFileError(f"cannot write {path}: a folder of that name exists")
    try:
        handle, name = tempfile.mkstemp(suffix="".join(path.suffixes[-2:]), prefix=f".{path.stem[:32]}-", dir=folder)
        os.close(handle)
    except OSError as error:
        raise OutputFileError(
            f"cannot write {path}: {error.strerror or error}; check that the folder exists and is writable"
        ) from error
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except OSError as error:
        raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a whole file atomically; see `atomic_output`."""
    with atomic_output(path) as temporary:
        temporary.write_bytes(data)
