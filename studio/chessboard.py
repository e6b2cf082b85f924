"""A picture of the correspondence: a chessboard laid on the source, carried to the target by the map.

Where the squares of the target lie on the same features as the source's the map is right; where they crowd, bend or
tear it is not (Xiang et al. 2008, figure 6).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image

from cloning.mapping import SkinPlaces
from fba.arrays import Floats
from fba.scene import Role
from studio.render import make_renderer
from studio.render.camera import frame_face
from studio.render.colors import shape_colors
from studio.render.drawable import Decal, Drawable, same_place, smooth_normals
from studio.sheet import Sheet, UInt8

SQUARE = 0.125
"""Side of a square, in eye separations of the source."""

SQUARES = 64
"""Squares along a side of the board: it covers the whole head."""

TEXELS = 24
"""Side of a square in the board's picture."""

DARK = (96, 112, 140)
SKIN = (0.90, 0.82, 0.76)


def chessboard(
    source: SkinPlaces,
    target: SkinPlaces,
    size: tuple[int, int] = (480, 600),
    poses: Sequence[tuple[str, Mapping[str, Floats], Mapping[str, Floats]]] = (),
) -> Image.Image:
    """Draw source and target with the board, side by side.

    Parameters
    ----------
    source, target : as from `cloning.mapping.map_skin`.
    size : (width, height) of each face's picture.
    poses : more rows below the neutral faces: a caption, and for source and target shape name -> world vertices.
    """
    sheet = Sheet("Correspondence")
    pictures = [_picture(face, size, {}) for face in (source, target)]
    sheet.add_row("", pictures, [source.scene.name or "source", target.scene.name or "target"])
    for caption, mine, yours in poses:
        sheet.add_row("", [_picture(source, size, mine), _picture(target, size, yours)], [caption, caption])
    return sheet.image()


def _picture(face: SkinPlaces, size: tuple[int, int], world: Mapping[str, Floats]) -> UInt8:
    board = _board()
    drawables = []
    for shape in face.scene.shapes:
        if not shape.mesh.face_count or shape.role is Role.OTHER:
            continue
        vertices = world.get(shape.name, face.scene.world_vertices(shape.name))
        triangles = shape.mesh.triangles
        normals = smooth_normals(vertices, triangles, same_place(vertices))
        if shape.name in face.places:
            decal = Decal(board, _on_board(face.places[shape.name])[triangles])
            drawables.append(Drawable(vertices, triangles, np.array(SKIN), normals, decal=decal))
        else:
            drawables.append(Drawable(vertices, triangles, shape_colors(shape), normals))
    return make_renderer().render(drawables, frame_face(face.scene, face.points), *size)


def _board() -> UInt8:
    """(h, w, 3) the chessboard."""
    cell = np.arange(SQUARES * TEXELS) // TEXELS
    dark = (cell[:, None] + cell[None]) % 2 == 1
    return np.where(dark[..., None], np.array(DARK, np.uint8), np.uint8(255)).astype(np.uint8)


def _on_board(places: Floats) -> Floats:
    """(n, 2) where places lie on the board, seen from the front: 0..1, the first row on top."""
    seen: Floats = 0.5 + places[:, :2] * np.array([1.0, -1.0]) / (SQUARE * SQUARES)
    return seen
