"""``fba doctor``: what this machine has, what is missing, and the command that adds it."""

from __future__ import annotations

import os
import platform
import shutil
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

import typer

from studio.cli.arguments import AsJson
from studio.cli.outcome import Outcome

CORE = ("numpy", "scipy", "usd-core", "typer", "rich", "pillow")


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the doctor's report."""

    name: str
    ok: bool
    needed: bool
    detail: str


def doctor(as_json: AsJson = False) -> None:
    """Check the installation: packages, the shipped face, rendering, optional parts."""
    from studio.cli.console import console, print_json, table

    checks = [
        Check("Python", True, True, platform.python_version()),
        *(_package(name) for name in CORE),
        _source(),
        _egl(),
        _ffmpeg(),
        _numba(),
        detector_check(),
        _program("MP4Box", "checks BT files against a second implementation; part of GPAC"),
        _program("chromium", "checks VRML files in a browser: apt-get install chromium"),
    ]
    if as_json:
        print_json({"checks": [asdict(c) for c in checks]})
    else:
        rows = [(c.name, "ok" if c.ok else ("MISSING" if c.needed else "not there"), c.detail) for c in checks]
        table("", ("part", "state", "detail"), rows, console())
    if any(c.needed and not c.ok for c in checks):
        raise typer.Exit(Outcome.FINDINGS)


def _package(name: str) -> Check:
    try:
        return Check(name, True, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, True, f"pip install {name}")


def _source() -> Check:
    from fba.errors import FbaError
    from formats import read_face

    try:
        face = read_face("default")
    except (FbaError, FileNotFoundError) as error:
        return Check("shipped source face", False, True, f"{error}; reinstall fba-toolkit")
    return Check("shipped source face", True, True, f"{face.scene.vertex_count} vertices, {len(face.tables)} tables")


def _egl() -> Check:
    from studio.render import make_renderer

    name = make_renderer().name
    if name.startswith("egl"):
        return Check("EGL rendering", True, False, name)
    detail = f"{name}; faster: pip install 'fba-toolkit[render]' and apt-get install libegl1 libgl1-mesa-dri"
    return Check("EGL rendering", False, False, detail)


def _ffmpeg() -> Check:
    try:
        return Check("mp4 output", True, False, f"imageio-ffmpeg {version('imageio-ffmpeg')}")
    except PackageNotFoundError:
        found = shutil.which("ffmpeg")
        return Check("mp4 output", found is not None, False, found or "pip install 'fba-toolkit[video]'")


def _numba() -> Check:
    try:
        return Check("compiled loops", True, False, f"numba {version('numba')}")
    except PackageNotFoundError:
        return Check("compiled loops", False, False, "faster correspondences: pip install 'fba-toolkit[fast]'")


def detector_check() -> Check:
    """Whether points of photographs can be found."""
    from studio.picture_detector import COMMANDS, FBA_DETECTOR, DetectorError, detector_version

    python = os.environ.get(FBA_DETECTOR, "")
    if not python:
        detail = (
            f"finds points in photographs for fba analogy: {COMMANDS}, then export {FBA_DETECTOR}=DETECTOR/bin/python"
        )
        return Check("picture points", False, False, detail)
    try:
        return Check("picture points", True, False, f"mediapipe {detector_version(python)} in {python}")
    except DetectorError as error:
        return Check("picture points", False, False, f"{FBA_DETECTOR}: {error}")


def _program(name: str, purpose: str) -> Check:
    found = shutil.which(name)
    return Check(name, found is not None, False, found or purpose)
