"""Candide-3's animation units: names, offsets, and refusals that name the line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fba.errors import InputFileError, TextSyntaxError
from formats import read_scene
from formats.shapes import read_shapes
from formats.wfm import read_animation_units

TEXT = """# VERTEX LIST:
3
0 0 0
1 0 0
0 1 0

# ANIMATION UNITS LIST:
2

# Jaw drop
2
0 0 -0.26 -0.05
2 0.5 0 0

# Twice named
2
1 0.01 0.1 0
1 0.02 0 0

# SHAPE UNITS LIST:
0
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.wfm"
    path.write_text(text, "latin-1")
    return path


MESH = TEXT.replace("# ANIMATION", "# FACE LIST:\n1\n0 1 2\n\n# ANIMATION", 1)


def test_the_neutral_mesh(tmp_path: Path) -> None:
    mesh = read_scene(written(tmp_path, MESH)).shapes[0].mesh
    assert np.array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert [list(mesh.face(f)) for f in range(mesh.face_count)] == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0 1 2\n", "0 1 3\n", r"line 9.*\(0 to 2\)"),
        ("0 1 2\n", "0 1\n", "line 9.*three or more"),
        ("1 0 0\n", "1 0\n", "line 4.*three finite coordinates"),
        ("1 0 0\n", "1 inf 0\n", "line 4.*three finite coordinates"),
        ("# FACE LIST:\n1", "# FACE LIST:\nmany", "line 8.*the number of polygons"),
        ("# FACE LIST:\n1", "# FACE LIST:\n\N{SUPERSCRIPT THREE}", "line 8.*the number of polygons"),
        ("# FACE LIST:\n1", "# FACE LIST:\n" + "9" * 5000, "line 8.*the number of polygons"),
        ("0 1 2\n", f"0 1 {'9' * 5000}\n", "line 9.*three or more"),
    ],
)
def test_damaged_meshes_name_the_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(TextSyntaxError, match=said):
        read_scene(written(tmp_path, MESH.replace(old, new, 1)))


def test_a_mesh_without_polygons_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="FACE LIST"):
        read_scene(written(tmp_path, TEXT))


def test_candide_reads_like_its_obj(shared: Path) -> None:
    folder = shared / "faces" / "candide3"
    mine, other = read_scene(folder / "candide3.wfm"), read_scene(folder / "candide3.obj")
    assert np.allclose(mine.shapes[0].mesh.vertices, other.shapes[0].mesh.vertices, atol=1e-6)
    assert np.array_equal(mine.shapes[0].mesh.indices, other.shapes[0].mesh.indices)


def test_units_with_their_names(tmp_path: Path) -> None:
    (jaw, opened), (other, twice) = read_animation_units(written(tmp_path, TEXT), 3)
    assert (jaw, other) == ("Jaw drop", "Twice named")
    assert np.array_equal(opened, [[0, -0.26, -0.05], [0, 0, 0], [0.5, 0, 0]])
    assert np.allclose(twice, [[0, 0, 0], [0.03, 0.1, 0], [0, 0, 0]])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("2\n\n# Jaw", "two\n\n# Jaw", "line 8.*the number of units"),
        ("2\n0 0 -0.26", "x\n0 0 -0.26", "line 11.*the number of vertices"),
        ("2 0.5 0 0", "2 0.5 0", "line 13.*three finite offsets"),
        ("2 0.5 0 0", "3 0.5 0 0", r"line 13.*\(0 to 2\)"),
        ("2 0.5 0 0", "2 a 0 0", "line 13.*vertex dx dy dz"),
        ("2 0.5 0 0", "2 nan 0 0", "line 13.*three finite offsets"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(TextSyntaxError, match=said):
        read_animation_units(written(tmp_path, TEXT.replace(old, new, 1)), 3)


def test_cut_and_foreign_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TextSyntaxError, match="vertex dx dy dz"):
        read_animation_units(written(tmp_path, TEXT[: TEXT.index("1 0.02")]), 3)
    with pytest.raises(InputFileError, match="no animation units"):
        read_animation_units(written(tmp_path, "# VERTEX LIST:\n0\n"), 3)


def test_candide_itself(shared: Path) -> None:
    scene = read_scene(shared / "faces/candide3/candide3.obj")
    found = read_shapes(shared / "faces/candide3/candide3.wfm", scene)
    assert len(found.names) == 14
    assert found.names[3] == "Jaw drop"
    assert np.allclose(found.deltas[3, 40], [0.0, -0.26, -0.05])
    assert [np.count_nonzero(d.any(axis=1)) for d in found.deltas][3] == 12
