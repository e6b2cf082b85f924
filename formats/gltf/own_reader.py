"""Our own glTF files back to scenes and faces; files of other programs as plain scenes."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from fat.face import AnimatableFace
from fba.errors import InputFileError
from fba.scene import FaceScene
from formats.gltf.buffers import to_single
from formats.gltf.data import GltfData, Json
from formats.gltf.own import FORMAT, KEY, read_own
from formats.gltf.primitives import split
from formats.gltf.reader import GltfDocument, read_data

CHANGED = "another program has changed this file, so the tables that this toolkit put into it are left out"


def read_gltf(path: Path) -> FaceScene | AnimatableFace:
    """Read a file of any origin; see `formats.gltf.read`."""
    data = GltfData(path)
    own = own_json(data)
    found = None if own is None else read_unchanged(data, own)
    if found is not None:
        return found
    scene = read_data(data)
    if own is not None and isinstance(scene.document, GltfDocument):
        document = replace(scene.document, remarks=(CHANGED, *scene.document.remarks))
        scene = replace(scene, document=document)
    return scene


def own_json(data: GltfData) -> Json | None:
    """What this toolkit's writer put into the extras of the scene, if the file is its work.

    Raises
    ------
    InputFileError
        If it was written by a version that this one does not know.
    """
    if not data.list(data.document, "scenes"):
        return None
    extras = data.item("scenes", data.document.get("scene", 0)).get("extras")
    own = extras.get(KEY) if isinstance(extras, dict) else None
    written = own.get("format") if isinstance(own, dict) else None
    if not isinstance(own, dict) or not isinstance(written, str):
        return None
    if written != FORMAT:
        raise InputFileError(f"{data.path} has the format '{written[:40]}'; this version reads '{FORMAT}'")
    return own


def read_unchanged(data: GltfData, own: Json) -> FaceScene | AnimatableFace | None:
    """The face, unless its bytes or the meshes that others see are no longer those that were written."""
    views = data.list(data.document, "bufferViews")
    view = own.get("bufferView")
    bytes_of_face = data.bytes_of(view) if isinstance(view, int) and 0 <= view < len(views) else b""
    if hashlib.sha256(bytes_of_face).hexdigest() != own.get("sha256"):
        return None
    try:
        found = read_own(own, bytes_of_face)
    except InputFileError as error:
        raise data.fail(str(error)) from None
    scene = found.scene if isinstance(found, AnimatableFace) else found
    if not same_meshes(data, scene):
        return None
    scene = replace(scene, images=_images(data))
    return replace(found, scene=scene) if isinstance(found, AnimatableFace) else scene


def _images(data: GltfData) -> dict[str, bytes]:
    images = [data.item("images", number) for number in range(len(data.list(data.document, "images")))]
    return {data.name(image): data.bytes_of(image["bufferView"]) for image in images if "bufferView" in image}


def same_meshes(data: GltfData, scene: FaceScene) -> bool:
    """True if the meshes of the file are those that the writer makes of this scene."""
    drawn = [shape for shape in scene.shapes if shape.mesh.face_count]
    meshes = [data.item("meshes", number) for number in range(len(data.list(data.document, "meshes")))]
    if len(meshes) != len(drawn):
        return False
    for shape, mesh in zip(drawn, meshes, strict=True):
        primitives = split(shape, np.zeros_like(shape.mesh.vertices))
        entries = data.list(mesh, "primitives")
        if len(entries) != len(primitives):
            return False
        for primitive, entry in zip(primitives, entries, strict=True):
            attributes = data.dict(entry, "attributes") if isinstance(entry, dict) else {}
            if "POSITION" not in attributes:
                return False
            points = data.accessor(attributes["POSITION"], "VEC3")
            if not np.array_equal(points, to_single(shape.mesh.vertices[primitive.vertices])):
                return False
    return True
