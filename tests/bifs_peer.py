"""What the toolkit writes as BT and XMT-A, and what MP4Box makes of it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
from faces import small_face

from fat import AnimatableFace
from fba import FapStream
from formats import read_face, write
from formats.streams import read_stream

MP4BOX = shutil.which("MP4Box")


def golden_stream() -> FapStream:
    """Low-level FAPs, one that is not always spoken of, visemes, an expression, a frame that changes nothing."""
    stream = FapStream.build(
        25,
        5,
        {3: [0, 300, 600, 600, -40], 6: [0, 10, 20, 20, 30], 23: [0, 0, 5000, 5000, 0], 31: [5, 5, 5, 5, 5]},
        visemes=[[0, 0, 0, 0], [1, 0, 63, 0], [1, 4, 31, 0], [1, 4, 31, 0], [0, 0, 0, 1]],
        expressions=[[1, 20, 0, 0, 0, 0]] * 4 + [[1, 40, 2, 10, 1, 0]],
        name="golden",
    )
    mask = stream.mask.copy()
    mask[0, 5] = mask[4, 22] = False
    return FapStream(25, stream.values * mask, mask, stream.visemes, stream.expressions, stream.frame_numbers, "golden")


def decoded(source: Path, folder: Path, dump: str, *, names: bool = True) -> Path:
    """Encode a file to MP4 and decode that as "bt" or "xmt", in a folder of its own: decoding overwrites."""
    assert MP4BOX is not None
    folder.mkdir()
    source, folder = source.resolve(), folder.resolve()
    scene = folder / "scene.mp4"
    flags = ["-def"] if names else []
    for words in ([*flags, "-mp4", str(source), "-out", str(scene)], [f"-{dump}", str(scene)]):
        done = subprocess.run([MP4BOX, *words], cwd=folder, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        assert "Warning" not in done.stderr, done.stderr[-2000:]
    return scene.with_suffix(f".{dump}")


def assert_peer_agrees(path: Path, face: AnimatableFace, stream: FapStream | None, *, names: bool = True) -> None:
    """A decoded file holds the same face and stream, but for the six digits that MP4Box prints."""
    found = read_face(path)
    shapes = {a.name: b.name for a, b in zip(face.scene.shapes, found.scene.shapes, strict=True)}
    for a, b in zip(found.scene.shapes, face.scene.shapes, strict=True):
        np.testing.assert_array_equal(a.mesh.indices, b.mesh.indices)
        np.testing.assert_array_equal(a.mesh.offsets, b.mesh.offsets)
        np.testing.assert_allclose(a.mesh.vertices, b.mesh.vertices, rtol=1e-5, atol=1e-9)
        assert not names or (a.name, a.role) == (b.name, b.role)
    np.testing.assert_allclose(found.scene.world_neutral(), face.scene.world_neutral(), rtol=1e-4, atol=1e-4)
    assert [t.key for t in found.tables] == [t.key for t in face.tables]
    for table, wanted in zip(found.tables, face.tables, strict=True):
        assert [m.shape for m in table.meshes] == [shapes[m.shape] for m in wanted.meshes]
        for m, n in zip(table.meshes, wanted.meshes, strict=True):
            np.testing.assert_array_equal(m.interval_borders, n.interval_borders)
            np.testing.assert_array_equal(m.coord_index, n.coord_index)
            np.testing.assert_allclose(m.displacements, n.displacements, rtol=1e-5, atol=1e-12)
        for t, u in zip(table.transforms, wanted.transforms, strict=True):
            assert t.field is u.field
            np.testing.assert_allclose(t.rotation_def, u.rotation_def, rtol=1e-5, atol=1e-12)
            np.testing.assert_allclose(t.translation_def, u.translation_def, rtol=1e-5, atol=1e-12)
    wanted_points = face.feature_points.positions(face.scene)
    for key, position in found.feature_points.positions(found.scene).items():
        np.testing.assert_allclose(position, wanted_points[key], atol=1e-4)
    assert not names or (found.feature_points.keys(), found.fapu) == (face.feature_points.keys(), face.fapu)
    if stream is not None:
        assert_same_frames(path, stream, names=names)


def assert_same_frames(path: Path, stream: FapStream, *, names: bool) -> None:
    found, findings = read_stream(path)
    assert [f.code for f in findings] == ([] if names else ["frame-rate"])
    assert (found.frame_rate, found.name if names else stream.name) == (stream.frame_rate, stream.name)
    for field in ("values", "mask", "visemes", "expressions", "frame_numbers"):
        np.testing.assert_array_equal(getattr(found, field), getattr(stream, field), field)


def make_golden(folder: Path, scratch: Path) -> None:
    """Write the golden files anew; MP4Box must be on PATH."""
    for kind in ("bt", "xmt"):
        own = folder / f"face.{kind}"
        write(small_face(), own, golden_stream())
        shutil.copy(decoded(own, scratch / kind, kind), folder / f"mp4box.{kind}")
    shutil.copy(decoded(folder / "face.bt", scratch / "n", "bt", names=False), folder / "mp4box_without_names.bt")
