"""Opening and saving stages: one-line errors, a quiet stderr, outputs that are whole or absent."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pxr import Sdf, Tf, Usd, UsdUtils

from fba.errors import InputFileError, OutputFileError
from fba.scene import FaceScene
from formats.files import atomic_output, read_bytes
from formats.usd import package
from formats.usd.crate import MAGIC, impossible_count

_MAGIC = (b"#usda", b"#sdf", MAGIC, package.MAGIC)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep OpenUSD's warnings off stderr; its errors become exceptions as always."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        del delegate


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what OpenUSD raises about a damaged file into one InputFileError."""
    with quiet():
        try:
            # Damaged numbers may overflow; what comes of them is checked where it matters.
            with np.errstate(all="ignore"):
                yield
        except (Tf.ErrorException, RuntimeError, ValueError, TypeError, OverflowError, MemoryError) as error:
            # OpenUSD's own errors; and Python's, where an attribute holds a value of another type than ours.
            raise InputFileError(f"{path} is not a readable USD file: {_first_message(error, path)}") from error


def open_stage(path: Path) -> tuple[Usd.Stage, Mapping[str, bytes]]:
    """Open a stage with all its payloads. Call it inside `reading`.

    Returns
    -------
    stage, and the files of a package by their names, the layer of the stage first; empty for a single file.

    Raises
    ------
    InputFileError
        If the file is missing, empty or not USD, or if a file that it refers to cannot be opened; if a package is
        damaged or wants something from outside.
    """
    data = read_bytes(path)
    if not data.startswith(_MAGIC):
        raise InputFileError(f"{path} is not a USD file: it starts neither like .usda text nor like .usdc data")
    packed = package.entries(data, path) if data.startswith(package.MAGIC) else {}
    impossible = impossible_count(data)
    if impossible:
        raise InputFileError(f"{path} is damaged: {impossible}")
    known = Sdf.Layer.Find(str(path.absolute()))
    if known and not known.dirty:
        # Somebody in this process still holds the file as it was; look whether it has changed since.
        known.Reload()
    package.check_references(packed, path)
    stage = Usd.Stage.Open(str(path.absolute()))
    problems = stage.GetCompositionErrors()
    if problems:
        raise InputFileError(
            f"{path} refers to something that cannot be opened: {_one_line(str(problems[0]))} "
            "Put the missing file in its place, or flatten the stage before reading."
        )
    return stage, packed


def placed(scene: FaceScene, path: Path) -> package.Packed:
    """The scene as it is written to a file of this name: in a package with its images, else as it is."""
    return package.packed_images(scene) if path.suffix.lower() == ".usdz" else package.Packed(scene, {})


def save_layer(layer: Sdf.Layer, path: Path, images: Mapping[str, bytes]) -> None:
    """Write a layer atomically: .usda as text, .usdc and .usd as data, .usdz with these images."""
    kind = path.suffix.lower().removeprefix(".")
    kind = "usdc" if kind == "usd" else kind
    with quiet(), atomic_output(path) as temporary:
        try:
            if kind == "usdz":
                temporary.write_bytes(package.package_of(layer, path.stem, images))
                return
            done = layer.Export(str(temporary.absolute()), args={"format": kind})
        except Tf.ErrorException as error:
            raise OutputFileError(f"cannot write {path}: {_first_message(error, path)}") from error
        if not done:
            raise OutputFileError(f"cannot write {path}; check that there is space left")


def _first_message(error: Exception, path: Path) -> str:
    try:
        whole = str(error)
    except UnicodeDecodeError:
        return "the text is not UTF-8"
    except MemoryError:
        return "it asks for more memory than there is"
    found = re.search(r" : '(.*?)'\s*(?:\n|$)", whole, re.DOTALL)
    text = found.group(1) if found else whole
    return _one_line(text.replace(str(path.absolute()), path.name))


def _one_line(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 300 else line[:300] + "..."
