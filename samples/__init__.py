"""Faces and streams that ship with the toolkit, found from an installed wheel too."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def sample(name: str) -> Path:
    """Return the path of a shipped file, e.g. ``sample("faces/quad_head.obj")``.

    Raises
    ------
    FileNotFoundError
        If there is no such sample.
    """
    path = Path(str(files("samples"))) / "data" / name
    if not path.exists():
        raise FileNotFoundError(f"there is no sample '{name}'")
    return path


def default_source() -> Path:
    """The shipped animatable source face."""
    return sample("faces/source.wrl.gz")
