"""Files of other programs are read: every mesh among the real faces, every example that the references quote."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fat import AnimatableFace
from fba.errors import UnknownFormatError
from formats import format_of, read, read_scene

FENCE = re.compile(r"^```[a-z]*\n(.*?)^```", re.S | re.M)
STARTS = {"InitialObjectDescriptor": ".bt", "#VRML V2.0": ".wrl", "<?xml": ".xmt"}


def test_every_mesh_among_the_real_faces_is_read(shared: Path) -> None:
    found: dict[str, int] = {}
    for path in sorted((shared / "faces").rglob("*.*")):
        try:
            format_of(path)
        except UnknownFormatError:
            continue
        scene = read_scene(path)
        vertices = scene.world_neutral()
        assert np.isfinite(vertices).all()
        assert sum(s.mesh.face_count for s in scene.shapes) > 100, path
        found[path.suffix] = found.get(path.suffix, 0) + 1
    assert found[".obj"] >= 14
    assert found[".glb"] >= 1
    assert found[".wfm"] >= 1


def test_every_example_in_the_references_is_a_face_with_tables(shared: Path, tmp_path: Path) -> None:
    kinds = []
    for reference in sorted((shared / "reference").glob("*.md")):
        for number, text in enumerate(FENCE.findall(reference.read_text("utf-8"))):
            kind = next((k for start, k in STARTS.items() if text.startswith(start)), None)
            if kind is None:
                continue
            path = tmp_path / f"{reference.stem}_{number}{kind}"
            path.write_text(text, "utf-8")
            face = read(path)
            assert isinstance(face, AnimatableFace), path.name
            assert {t.fap_id for t in face.tables} >= {3}, path.name
            assert any(mesh.displacements.any() for t in face.tables for mesh in t.meshes), path.name
            kinds.append(kind)
    assert {".bt", ".wrl", ".xmt"} <= set(kinds)
