"""Scenes and animatable faces to glTF 2.0 files."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.arrays import Floats
from fba.errors import FapStreamError, MeshError, OutputFileError
from fba.scene import FaceScene, Shape
from fba.stream import FapStream
from formats.files import atomic_output, write_bytes
from formats.gltf.buffers import Buffer, Json, to_single
from formats.gltf.jaw import add_jaw, jaw_motion, lower_teeth
from formats.gltf.materials import Materials
from formats.gltf.nodes import PATHS, Nodes
from formats.gltf.own import FORMAT, KEY, Pack, face_json, scene_json
from formats.gltf.primitives import write_mesh
from formats.node_motion import driven_fields
from formats.targets import Target, table_borders, table_targets, target_weights


class Draft:
    """A glTF file under construction.

    Attributes
    ----------
    nodes : name of a scene node -> its number in the file.
    own : the object in the scene's extras.
    """

    def __init__(self, scene: FaceScene, targets: Mapping[str, Sequence[Target]]) -> None:
        self.scene = scene
        self.buffer = Buffer()
        self._pack = Pack()
        self._targets = targets
        self._materials = Materials(self.buffer, scene)
        self._meshes: list[Json] = []
        nodes = Nodes(scene, self._mesh)
        if not self._meshes:
            raise MeshError(f"'{scene.name}' has no polygons, so there is nothing to write to glTF")
        self.nodes = nodes.of
        self._nodes = nodes.entries
        self._animations: list[Json] = []
        self._teeth: Shape | None = None
        self._jaw = ""
        self.own: Json = {"format": FORMAT, "scene": scene_json(scene, self._pack)}

    def _mesh(self, shape: Shape) -> int | None:
        places = self.scene.file_order()[shape.name]
        extra = {name: values[places] for name, values in self.scene.vertex_attributes.items()}
        mesh = write_mesh(self.buffer, shape, self._targets.get(shape.name, ()), self._materials, extra)
        if mesh is None:
            return None
        self._meshes.append(mesh)
        return len(self._meshes) - 1

    def add_face(self, face: AnimatableFace) -> None:
        """Keep all that a face is; give it a node for its jaw."""
        self.own |= face_json(face, self._pack, self.nodes)
        self._teeth = lower_teeth(face.scene)
        if self._teeth is not None:
            self._jaw = add_jaw(self._nodes, self.nodes, self._teeth)

    def animate(self, face: AnimatableFace, stream: FapStream) -> None:
        """Play a stream: weights of the morph targets and fields of the nodes, at the time of every frame."""
        if not len(stream):
            raise FapStreamError(f"the stream '{stream.name}' has no frames")
        values = Player(face).table_values(stream)
        borders = {number: table_borders(table) for number, table in enumerate(face.tables)}
        channels: list[tuple[str, str, Floats]] = []
        for shape, targets in self._targets.items():
            weights = target_weights(targets, borders, values)
            if weights.any() and "mesh" in self._nodes[self.nodes[shape]]:
                channels.append((shape, "weights", weights.ravel()))
            if weights.any() and self._teeth is not None and shape == self._teeth.name:
                moves, turns = jaw_motion(self._teeth, targets, weights)
                channels += [(self._jaw, "translation", moves), (self._jaw, "rotation", _continuous(turns))]
        for (node, field), keys in driven_fields(face.scene, face.tables, values).items():
            channels.append((node, PATHS[field], _continuous(keys) if keys.shape[1] == 4 else keys))
        if channels:
            times = (stream.frame_numbers - stream.frame_numbers[0]) / stream.frame_rate
            self._animations.append(self._animation(stream.name, times, channels))

    def _animation(self, name: str, times: Floats, channels: Sequence[tuple[str, str, Floats]]) -> Json:
        time = self.buffer.keys(to_single(times), bounds=True)
        return {
            "name": name,
            "samplers": [
                {"input": time, "interpolation": "LINEAR", "output": self.buffer.keys(to_single(values))}
                for _, _, values in channels
            ],
            "channels": [
                {"sampler": number, "target": {"node": self.nodes[node], "path": path}}
                for number, (node, path, _) in enumerate(channels)
            ],
        }

    def save(self, path: Path) -> None:
        """Write the file; a .gltf with its buffer beside it."""
        self.own |= self._pack.write(self.buffer)
        data = self.buffer.data()
        document: Json = {
            "asset": {"version": "2.0", "generator": "fba-toolkit"},
            "scene": 0,
            "scenes": [{"name": self.scene.name, "nodes": [0], "extras": {KEY: self.own}}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "accessors": self.buffer.accessors,
            "bufferViews": self.buffer.views,
            "buffers": [{"byteLength": len(data)}],
        }
        self._materials.write(document)
        if self._animations:
            document["animations"] = self._animations
        if path.suffix.lower() == ".glb":
            write_bytes(path, _binary(_text(document), data))
            return
        beside = path.with_suffix(".bin")
        document["buffers"][0]["uri"] = quote(beside.name)
        with atomic_output(path) as main, atomic_output(beside) as other:
            main.write_bytes(_text(document))
            other.write_bytes(data)


def _continuous(turns: Floats) -> Floats:
    """Quaternions (f, 4) of the same rotations, each on the side of the one before."""
    flips = np.sum(turns[1:] * turns[:-1], axis=1) < 0.0
    signs = np.cumprod(np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]))
    sided: Floats = turns * signs[:, None]
    return sided


def _text(document: Json) -> bytes:
    try:
        return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    except ValueError as error:
        raise OutputFileError(f"this face holds a number or name that glTF's JSON cannot: {error}") from None


def _binary(text: bytes, data: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    if size > 0xFFFFFFFF:
        raise OutputFileError(f"the file would have {size} bytes, but a .glb holds at most {0xFFFFFFFF}")
    head = b"glTF" + struct.pack("<II", 2, size)
    return b"".join([head, struct.pack("<I", len(text)), b"JSON", text, struct.pack("<I", len(data)), b"BIN\0", data])


def write_gltf(face: FaceScene | AnimatableFace, path: Path, stream: FapStream | None) -> None:
    """Write a scene or a face; see `formats.gltf.write`."""
    if isinstance(face, AnimatableFace):
        draft = Draft(face.scene, table_targets(face))
        draft.add_face(face)
        if stream is not None:
            draft.animate(face, stream)
    else:
        draft = Draft(face, {})
    draft.save(path)
