"""Rounded tables are written to USD in few digits, and read back exactly all the same."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from faces import assert_same_face, small_face

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import FaceDefTables
from formats import usd


def rounded(places: int) -> AnimatableFace:
    face = small_face()
    tables = []
    for table in face.tables:
        meshes = []
        for mesh in table.meshes:
            slopes = np.round(mesh.displacements.astype(np.float64), places).astype(np.float32)
            meshes.append(replace(mesh, displacements=slopes))
        tables.append(replace(table, meshes=tuple(meshes)))
    return replace(face, tables=FaceDefTables(tuple(tables)))


def test_offsets_of_rounded_tables_are_short_and_right(tmp_path: Path) -> None:
    face, path = rounded(4), tmp_path / "face.usda"
    usd.write(face, path)
    found = usd.read(path)
    assert isinstance(found, AnimatableFace)
    assert_same_face(found, face)
    lines = [line for line in path.read_text().splitlines() if "offsets" in line.lower() and "[(" in line]
    words = [word for line in lines for point in re.findall(r"\(([-0-9.e, ]+)\)", line) for word in point.split(", ")]
    assert words
    digits = [w.partition("e")[0].lstrip("-").replace(".", "").lstrip("0") for w in words]
    assert max(map(len, digits)) <= 7, "float32 would have up to nine"
    assert "-0" not in words
    pose = Player(face).pose({3: 1080}).local["skin"]
    stored = Player(found).pose({3: 1080}).local["skin"]
    assert np.array_equal(pose, stored)
