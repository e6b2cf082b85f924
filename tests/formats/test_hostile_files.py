"""Files that mean harm: more memory than they have bytes, places out of all bounds, names that lead elsewhere.

Some were found by fuzzing (`benchmarks/fuzz.py`).
"""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import small_face
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks import fuzz
from benchmarks.fuzz_seeds import VRML, scene_seeds
from fba.errors import FbaError, InputFileError, MeshError
from fba.scene import FaceScene
from formats import read, read_scene, write
from formats.gltf import data as gltf_data
from formats.names import UniqueNames
from formats.textures import texture_bytes, texture_names
from formats.usd.crate import impossible_count

CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"


BOMB = gzip.compress(bytes(17 << 20), 6)


def refused(path: Path, data: bytes, *said: str) -> None:
    path.write_bytes(data)
    with pytest.raises(FbaError) as found:
        read(path)
    for words in (path.name, *said):
        assert words in str(found.value)


def gltf_of(folder: Path) -> dict:
    """The small face as a .gltf document whose buffer is text."""
    return json.loads(scene_seeds("gltf")[0])


# --- more than there are bytes --------------------------------------------------------------------------------------


def test_accessors_without_data_are_no_larger_than_the_file(tmp_path: Path) -> None:
    document = gltf_of(tmp_path)
    accessor = next(a for a in document["accessors"] if "bufferView" in a and a["type"] == "VEC3")
    del accessor["bufferView"]
    accessor["count"] = 1 << 26
    refused(tmp_path / "x.gltf", json.dumps(document).encode(), "67108864 elements but no data")


def test_accessors_that_share_bytes_are_bounded_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = gltf_of(tmp_path)
    del document["scenes"][0]["extras"]  # as another program's file
    primitive = next(m for m in document["meshes"] if "targets" in m["primitives"][0])["primitives"][0]
    path = tmp_path / "x.gltf"
    path.write_text(json.dumps(document))
    count = read_scene(path).vertex_count
    monkeypatch.setattr(gltf_data, "_MOST_NUMBERS", 1000)
    monkeypatch.setattr(gltf_data, "_NUMBERS_A_BYTE", 0)
    assert read_scene(path).vertex_count == count
    document["meshes"][0].pop("extras", None)
    document["meshes"][0]["primitives"][0]["targets"] = primitive["targets"][:1] * 1000
    refused(path, json.dumps(document).encode(), "share bytes")


@pytest.mark.parametrize("ending", [".wrl.gz", ".bt.gz", ".x3dz", ".xmta.gz"])
def test_packed_text_that_swells_is_not_read(ending: str, tmp_path: Path) -> None:
    refused(tmp_path / f"x{ending}", BOMB, "unpacks to more than 16 MiB")


def test_text_that_packs_well_is_read(tmp_path: Path) -> None:
    (tmp_path / "x.wrl").write_bytes(gzip.compress(VRML + b"\n" * (1 << 20), 9))
    assert read_scene(tmp_path / "x.wrl").vertex_count > 0


@pytest.mark.parametrize("ending", ["wrl", "bt"])
def test_nodes_that_use_each_other_do_not_multiply(ending: str, tmp_path: Path) -> None:
    text = b"#VRML V2.0 utf8\n" + VRML.replace(b"#VRML V2.0 utf8", b"") + b"DEF A0 Group { children USE S }\n"
    for k in range(1, 40):
        text += b"DEF A%d Group { children [ %s ] }\n" % (k, b"USE A%d " % (k - 1) * 10)
    (tmp_path / f"x.{ending}").write_bytes(text)
    assert read_scene(tmp_path / f"x.{ending}").vertex_count < 100


def test_numbers_in_headers_are_compared_with_the_bytes(tmp_path: Path) -> None:
    head = b"ply\nformat %s 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n"
    faces = b"element face 4000000000\nproperty list uchar int vertex_indices\nend_header\n"
    for kind in (b"binary_little_endian", b"ascii"):
        refused(tmp_path / "x.ply", head % kind + faces, "cut")
    refused(tmp_path / "x.stl", bytes(80) + b"\xff\xff\xff\xff" + bytes(50), "cut")
    refused(tmp_path / "x.off", b"OFF\n400000000 400000000 0\n0 0 0\n", "cut")
    refused(tmp_path / "x.wfm", b"# VERTEX LIST:\n400000000\n0 0 0\n", "coordinates")


def test_tables_of_a_usd_crate_that_end_with_the_file() -> None:
    """One whose last section is cut by some bytes is told, or left to OpenUSD."""
    for cut in range(64):
        sections = b"".join(name.ljust(16, b"\0") + (24).to_bytes(8, "little") * 2 for name in (b"TOKENS", b"PATHS"))
        data = b"PXR-USDC".ljust(16, b"\0") + (24).to_bytes(8, "little") + (2).to_bytes(8, "little") + sections
        said = impossible_count(data[: len(data) - cut])
        assert "claims 2 sections" in str(said) if cut else said is not None


def test_very_many_objects_are_one(tmp_path: Path) -> None:
    """Each would be cut out of the whole mesh by itself."""
    lines = [b"o n%d\n%sf -3 -2 -1\n" % (k, CORNERS) for k in range(1002)]
    path = tmp_path / "x.obj"
    path.write_bytes(b"".join(lines[:1000]))
    assert len(read_scene(path).shapes) == 1000
    path.write_bytes(b"".join(lines))
    scene = read_scene(path)
    assert (len(scene.shapes), scene.vertex_count) == (1, 3006)
    assert "1002 objects are read as one" in " ".join(scene.document.remarks)


def test_marks_that_open_and_never_close_are_read_in_one_go(tmp_path: Path) -> None:
    """Each was once followed to the end, from every one of them."""
    many = 200_000
    refused(tmp_path / "x.obj", CORNERS + b"f 1/ 2 3\nf 1" + b"/" * many + b"x 2 3\n", "line 5")
    for tail in (b"", b"\\"):
        info = b'"one" "' + b'\\"' * many + tail
        text = b"<X3D><Scene><WorldInfo info='" + info + b"'/></Scene></X3D>"
        refused(tmp_path / "x.x3d", text, "no IndexedFaceSet")


def test_very_many_nodes_of_one_name(tmp_path: Path) -> None:
    """Every number behind a name was once tried again for each of them."""
    document = gltf_of(tmp_path)
    node = next(n for n in document["nodes"] if "mesh" in n)
    count = 20_000
    names = UniqueNames()
    assert [names.take("a") for _ in range(count)] == ["a", *(f"a_{k}" for k in range(2, count + 1))]
    document["nodes"] = [{"mesh": node["mesh"], "name": "a"}] * 300
    document["scenes"] = [{"nodes": list(range(300))}]
    (tmp_path / "x.gltf").write_text(json.dumps(document))
    assert [s.name for s in read_scene(tmp_path / "x.gltf").shapes][-1] == "a_300"


# --- out of all bounds ----------------------------------------------------------------------------------------------


def test_vertices_out_of_all_bounds(tmp_path: Path) -> None:
    """Squares of such coordinates are infinite, so that nothing on the surface is nearest to a feature point."""
    refused(tmp_path / "x.obj", CORNERS + b"v 1e308 0 0\nf 1 2 3\nf 1 2 4\n", "vertex 3", "1e+308", "out of all bounds")
    for ending in (".bt", ".wrl", ".xmt"):
        path = tmp_path / f"face{ending}"
        write(small_face(), path)
        text = path.read_text()
        start = text.index("1.6")
        refused(path, (text[:start] + "1e300" + text[start + 3 :]).encode(), "out of all bounds")


def test_transforms_out_of_all_bounds(tmp_path: Path) -> None:
    text = VRML.replace(b"scale 1 2 1", b"scale 1 2e38 1").replace(b".5 .5 1", b".5 1e20 1")
    refused(tmp_path / "x.wrl", text, "out of all bounds")


def test_corners_without_texture_coordinates(tmp_path: Path) -> None:
    """The face that this toolkit put into the file has none, though the mesh says that there are."""
    document = gltf_of(tmp_path)
    own = document["scenes"][0]["extras"]["fba"]["scene"]["roots"][0]["children"][0]["mesh"]
    own["texcoord_indices"]["shape"] = [0]
    refused(tmp_path / "x.gltf", json.dumps(document).encode(), "texture coordinate indices must match")
    mesh = small_face().scene.shape("skin").mesh
    with pytest.raises(MeshError, match="texture coordinate indices must match"):
        replace(mesh, texcoord_indices=np.zeros(0, np.int32))


# --- names that lead elsewhere --------------------------------------------------------------------------------------


def with_texture(scene: FaceScene, name: str) -> FaceScene:
    changed = {
        s.name: replace(s, materials=tuple(replace(m, texture=name, shading=None) for m in s.materials))
        for s in scene.shapes
    }
    return scene.map_shapes(changed)


@pytest.mark.parametrize("ending", ["obj", "wrl", "bt", "xmt", "x3d", "gltf"])
def test_images_of_other_folders_are_not_opened(ending: str, tmp_path: Path) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "secret.png").write_bytes(b"\x89PNG secret")
    (folder / "link.png").symlink_to(tmp_path / "secret.png")
    path = folder / f"face.{ending}"
    for name in ("../secret.png", str(tmp_path / "secret.png"), f"file://{tmp_path}/secret.png", "link.png"):
        if ending == "gltf":
            document = gltf_of(tmp_path)
            del document["scenes"][0]["extras"]
            document["images"] = [{"uri": name}]
            document["textures"] = [{"source": 0}]
            for material in document["materials"]:
                material["pbrMetallicRoughness"] = {"baseColorTexture": {"index": 0}}
            path.write_text(json.dumps(document))
        else:
            write(with_texture(small_face().scene, name), path)
        scene = read_scene(path)
        assert name in texture_names(scene)
        assert texture_bytes(scene, name) is None


# --- text of a format's own words -----------------------------------------------------------------------------------

TEXTS = sorted({*fuzz.kinds()} - {"fba", "glb", "stl"})
HEADS = {
    "off": b"OFF\n",
    "ply": b"ply\nformat ascii 1.0\n",
    "usda": b"#usda 1.0\n",
    "gltf": b'{"asset": {"version": "2.0"}, ',
    "x3d": b"<X3D><Scene>",
    "xmt": b"<XMT-A><Body>",
    "obj": CORNERS,
    "mtl": b"newmtl red\n",
    "cues": b'{"mouthCues": ',
}
MARKS = (" ", "\n", "[", "]", "{", "}", '"', "<", "/>", ":", ",", "0", "1", "-1", "2.5", "1e30", "3/3/3", "#")


@pytest.mark.parametrize("kind", TEXTS)
def test_any_words_end_in_a_scene_a_stream_or_one_message(kind: str) -> None:
    target = fuzz.target_of(kind)
    words = fuzz.words_of(fuzz.seeds(kind))

    @settings(max_examples=25, deadline=None, derandomize=True, database=None)
    @given(st.lists(st.sampled_from((*words, *MARKS)), max_size=60))
    def trial(chosen: list[str]) -> None:
        assert fuzz.check(target, HEADS.get(kind, b"") + " ".join(chosen).encode()) is None

    trial()


@pytest.mark.parametrize("kind", ["fba", "glb", "stl", "ply"])
@settings(max_examples=25, deadline=None, derandomize=True, database=None)
@given(st.data())
def test_any_bytes_behind_a_good_beginning_end_so_too(kind: str, data: st.DataObject) -> None:
    seed = data.draw(st.sampled_from(fuzz.seeds(kind)))
    start = data.draw(st.integers(4, len(seed)))
    assert fuzz.check(fuzz.target_of(kind), seed[:start] + data.draw(st.binary(max_size=200))) is None


def test_folders_and_files_of_other_kinds_are_said(tmp_path: Path) -> None:
    (tmp_path / "x.obj").mkdir()
    with pytest.raises(InputFileError, match="is a folder"):
        read(tmp_path / "x.obj")
