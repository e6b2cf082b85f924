"""Playing a FAP stream on a face: vertices of every frame, or pictures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fat.evaluate import Player
from fat.face import AnimatableFace
from fba.errors import OutputFileError
from fba.orientation import to_file_order
from fba.stream import FapStream
from formats.npz import write_npz
from studio.movie import write_animation
from studio.render import Figure, make_renderer

LIMIT = 16 << 30
"""Largest .npz in bytes; a longer stream has to be cut."""


def write_vertices(face: AnimatableFace, stream: FapStream, path: Path, rules: Collection[str] | None = None) -> None:
    """Write neutral (N, 3), vertices (frames, N, 3) and fps, all shapes in file order, the file's axes and units.

    rules : how FAPs that fight are combined; see `fat.evaluate.Player`.
    """
    count = face.scene.vertex_count
    if len(stream) * count * 24 > LIMIT:
        raise OutputFileError(f"{path}: {len(stream)} frames of {count} vertices are too large for one .npz")
    vertices = np.empty((len(stream), count, 3))
    start = 0
    for batch in Player(face, rules=rules).world_frames(stream):
        vertices[start : start + len(batch)] = to_file_order(face.scene, batch)
        start += len(batch)
    arrays = {
        "neutral": to_file_order(face.scene, face.scene.world_neutral()),
        "vertices": vertices,
        "fps": np.asarray(stream.frame_rate, dtype=np.float64),
    }
    write_npz(path, arrays)


def draw_frames(
    face: AnimatableFace,
    stream: FapStream,
    path: Path,
    size: int,
    tell: Callable[[str, float], None],
    rules: Collection[str] | None = None,
) -> None:
    """Draw every frame into an animated picture, a film or a folder of pictures."""
    renderer = make_renderer()
    figure = Figure.of_face(face)

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for index, pose in enumerate(Player(face, rules=rules).frames(stream)):
            tell("drawing", index / max(len(stream), 1))
            yield figure.draw(pose.world_shapes(), (size, size), renderer=renderer)

    write_animation(pictures(), stream.frame_rate, path)
