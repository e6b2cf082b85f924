"""USDZ packages: what is in them, and what is refused."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import small_face, small_scene
from PIL import Image
from pxr import Usd, UsdShade

from fat import AnimatableFace
from fba import FaceScene
from fba.errors import InputFileError
from formats import read, read_scene, usd, write
from formats.usd.crate import MAGIC
from formats.usd.validate import validate_stage


def _image(kind: str, color: tuple[int, int, int] = (200, 100, 50)) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (4, 4), color).save(out, kind)
    return out.getvalue()


def _textured(names: dict[str, bytes]) -> FaceScene:
    """The small scene with as many materials on its skin as there are images."""
    scene = small_scene()
    skin = scene.shape("skin")
    materials = tuple(replace(skin.materials[0], name=f"m{k}", texture=name) for k, name in enumerate(names))
    count = len(skin.mesh.arities)
    mesh = replace(skin.mesh, face_materials=np.arange(count) % len(names))
    changed = scene.map_shapes({"skin": replace(skin, materials=materials, mesh=mesh)})
    return replace(changed, images={name: data for name, data in names.items() if data})


def test_a_package_holds_the_stage_and_its_images(tmp_path: Path) -> None:
    names = {
        "face.png": _image("PNG"), "maps/lips.jpg": _image("JPEG"), "../brow.bmp": _image("BMP"),
        "Zunge ä.tga": _image("TGA"), "wrong.png": _image("JPEG"), "gone.png": b"", "junk.png": b"no image",
    }  # fmt: skip
    path = tmp_path / "face.usdz"
    write(_textured(names), path)
    assert [p.name for p in tmp_path.iterdir()] == ["face.usdz"]
    with zipfile.ZipFile(path) as package:
        listed = package.namelist()
        assert {entry.compress_type for entry in package.infolist()} == {zipfile.ZIP_STORED}
        assert package.read("face.png") == names["face.png"]
    inside = ["face.png", "maps/lips.jpg", "textures/brow.png", "textures/Zunge__.png", "textures/wrong.jpg"]
    assert listed == ["face.usdc", *inside]
    found = validate_stage(path)
    assert found == [], found
    scene = read_scene(path)
    assert set(scene.images) == set(inside)
    assert scene.images["maps/lips.jpg"] == names["maps/lips.jpg"]
    with Image.open(io.BytesIO(scene.images["textures/brow.png"])) as image:
        assert image.getpixel((1, 1)) == (200, 100, 50)
    # Materials whose image could not be had keep its name.
    assert [m.texture for m in scene.shape("skin").materials[-2:]] == ["gone.png", "junk.png"]


def test_openusd_finds_the_images(tmp_path: Path) -> None:
    path = tmp_path / "face.usdz"
    write(_textured({"face.png": _image("PNG"), "b.jpeg": _image("JPEG")}), path)
    stage = Usd.Stage.Open(str(path))
    assets = [
        UsdShade.Shader(p).GetInput("file").Get() for p in stage.Traverse() if p.GetName() == "Texture"
    ]  # fmt: skip
    assert sorted(a.resolvedPath for a in assets) == [f"{path}[b.jpeg]", f"{path}[face.png]"]


def test_data_begin_at_multiples_of_64_bytes(tmp_path: Path) -> None:
    path = tmp_path / "face.usdz"
    write(_textured({"a.png": _image("PNG"), "bcd.jpg": _image("JPEG")}), path)
    data = path.read_bytes()
    with zipfile.ZipFile(path) as package:
        for entry in package.infolist():
            name, extra = struct.unpack_from("<2H", data, entry.header_offset + 26)
            start = entry.header_offset + 30 + name + extra
            assert start % 64 == 0
            assert data[start : start + entry.file_size] == package.read(entry)


def test_images_of_a_package_go_along_to_other_formats(tmp_path: Path) -> None:
    first, second = tmp_path / "face.usdz", tmp_path / "face.usda"
    image = _image("PNG")
    write(replace(small_face(), scene=replace(small_scene(), images={"face.png": image})), first)
    found = read(first)
    assert isinstance(found, AnimatableFace)
    write(found, second)
    assert (tmp_path / "face.png").read_bytes() == image


def _packed(files: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as package:
        for name, data in files.items():
            package.writestr(zipfile.ZipInfo(name), data, compression)
    return out.getvalue()


def _stage(text: str = "") -> bytes:
    mesh = "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\nint[] faceVertexCounts = [3]\n"
    top = f'#usda 1.0\n(defaultPrim = "a")\ndef Mesh "a" {text} {{\n'
    return f"{top}{mesh}int[] faceVertexIndices = [0, 1, 2]\n}}\n".encode()


def _renamed(data: bytes, old: bytes, new: bytes, place: str) -> bytes:
    """Change a name in the header before the file, or in the directory at the end."""
    at = data.index(old) if place == "first" else data.rindex(old)
    return data[:at] + new + data[at + len(old) :]


def _claims(data: bytes, size: int) -> bytes:
    """Let the directory claim a size of the first file."""
    at = data.index(b"PK\x01\x02")
    return data[: at + 20] + struct.pack("<2I", size, size) + data[at + 28 :]


def _encrypted(data: bytes) -> bytes:
    at = data.index(b"PK\x01\x02")
    return data[: at + 8] + b"\x01" + data[at + 9 :]


GOOD = {"face.usda": _stage(), "other.usda": _stage()}
CRATE = MAGIC + b"\0" * 8 + struct.pack("<q", 24) + struct.pack("<Q", 1 << 60)
REFUSED: dict[str, Callable[[], bytes]] = {
    "compressed": lambda: _packed({"face.usda": _stage() + b"\0" * 9999}, zipfile.ZIP_DEFLATED),
    "encrypted": lambda: _encrypted(_packed(GOOD)),
    "claims more than there is": lambda: _claims(_packed(GOOD), 1 << 31),
    "leads up": lambda: _packed({**GOOD, "../../evil.png": b"x"}),
    "absolute": lambda: _packed({**GOOD, "/etc/evil.png": b"x"}),
    "drive": lambda: _packed({**GOOD, "C:evil.png": b"x"}),
    "package in package": lambda: _packed({**GOOD, "inner.usdz": _packed(GOOD)}),
    "another name outside than inside": lambda: _renamed(_packed(GOOD), b"other.usda", b"OTHER.usda", "first"),
    "same name twice": lambda: _renamed(
        _renamed(_packed({"a.usda": _stage(), "b.usda": _stage()}), b"b.usda", b"a.usda", "last"),
        b"b.usda",
        b"a.usda",
        "last",
    ),
    "no layer first": lambda: _packed({"a.png": b"x", **GOOD}),
    "nothing in it": lambda: _packed({}),
    "cut": lambda: _packed(GOOD)[:-30],
    "layer of impossible size": lambda: _packed({"face.usdc": CRATE}),
    "refers to another folder": lambda: _packed({"face.usda": _stage("(references = @../secret.usda@)")}),
    "refers to anywhere": lambda: _packed({"face.usda": _stage("(payload = @/tmp/secret.usda@)")}),
    "refers from a second layer": lambda: _packed(
        {"face.usda": _stage(), "parts/b.usda": _stage("(references = @../../secret.usda@)")}
    ),
}


@pytest.mark.parametrize("what", list(REFUSED))
def test_what_could_do_harm_is_refused(what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "secret.usda").write_bytes(_stage())
    folder = tmp_path / "in"
    folder.mkdir()
    path = folder / "face.usdz"
    path.write_bytes(REFUSED[what]())
    with pytest.raises(InputFileError) as caught:
        usd.read(path)
    assert "\n" not in str(caught.value)
    assert "face.usdz" in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_package_of_other_programs_is_read(tmp_path: Path) -> None:
    """Several layers, one of them in a folder, and an image beside it."""
    material = b"""#usda 1.0
(defaultPrim = "m")
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./skin.png@
        float3 outputs:rgb
    }
}
"""
    top = b"""#usda 1.0
(defaultPrim = "a")
def Xform "a" {
    def Material "m" (references = @parts/m.usda@) {}
    def "mesh" (references = @mesh.usda@
        prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </a/m>
    }
}
"""
    image = _image("PNG")
    files = {"top.usda": top, "mesh.usda": _stage(), "parts/m.usda": material, "parts/skin.png": image}
    path = tmp_path / "other.usdz"
    path.write_bytes(_packed(files))
    scene = read_scene(path)
    (shape,) = scene.shapes
    assert shape.mesh.vertex_count == 3
    (named,) = [m.texture for m in shape.materials]
    assert named is not None
    assert scene.images == {named: image} == {"parts/skin.png": image}
