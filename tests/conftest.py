"""What tests share: the folder of real faces (absent for most users) and small meshes."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

# Most people have no numba: tests go the numpy way, but for those of the compiled loops.
os.environ.setdefault("FBA_FAST", "0")

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of real faces, landmarks and streams; the test is skipped where it is absent, fails under CI."""
    if not SHARED.is_dir():
        if os.environ.get("CI"):
            pytest.fail("the folder of real faces is missing; CI must have it")
        pytest.skip("needs the folder of real faces beside the repository")
    return SHARED
