"""What a renderer draws: triangles with colours and normals, prepared for the pixel shader."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fba.arrays import Floats, Floats32, Ints, frozen
from fba.errors import MeshError


@dataclass(frozen=True, eq=False)
class Iris:
    """Iris and pupil painted on an eyeball, sharp at any density of its mesh.

    Attributes
    ----------
    directions : (n, 3) from the eye's centre to each vertex *at rest*, the third axis along the gaze; they
        ride on the vertices, so that the iris turns with the eyeball.
    angle : half opening angle of the iris seen from the eye's centre, radians.
    color : of the iris, sRGB 0..1.
    """

    directions: Floats
    angle: float = 0.5
    color: tuple[float, float, float] = (0.36, 0.49, 0.57)

    def __post_init__(self) -> None:
        object.__setattr__(self, "directions", frozen(self.directions, np.float64, (-1, 3)))


@dataclass(frozen=True, eq=False)
class Decal:
    """A picture that tints a surface: its colours multiply the surface's own.

    Attributes
    ----------
    image : (h, w, 3) uint8, first row on top.
    uv : (t, 3, 2) place of each triangle's corners in it, (0, 0) the upper left and (1, 1) the lower right
        corner; outside, the surface is left as it is.
    """

    image: NDArray[np.uint8]
    uv: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "image", frozen(self.image, np.uint8))
        object.__setattr__(self, "uv", frozen(self.uv, np.float64, (-1, 3, 2)))

    @cached_property
    def touched(self) -> NDArray[np.bool_]:
        """(t,) True for triangles in whose bounds some texel is not white."""
        height, width = self.image.shape[:2]
        sums = np.zeros((height + 1, width + 1), dtype=np.int64)
        sums[1:, 1:] = np.cumsum(np.cumsum((self.image < 255).any(axis=2), axis=0), axis=1)
        size = np.array([width, height])
        low = np.clip(np.floor(self.uv.min(axis=1) * size), 0, size).astype(np.int64)
        high = np.clip(np.floor(self.uv.max(axis=1) * size) + 1, 0, size).astype(np.int64)
        (x0, y0), (x1, y1) = low.T, high.T
        colored = sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]
        return np.asarray((colored > 0) & (x1 > x0) & (y1 > y0))


@dataclass(frozen=True, eq=False)
class Drawable:
    """One thing to draw.

    Attributes
    ----------
    vertices : (n, 3) world coordinates, inside axes.
    triangles : (t, 3) vertex indices, counterclockwise seen from outside.
    color : sRGB 0..1: (3,) for all, (n, 3) one for each vertex, or (t, 3) one for each triangle. Where n = t,
        it is taken for vertices.
    normals : (n, 3) unit normals for smooth shading; None shades every triangle flat.
    gloss : strength of the highlight, 0..1, or (n,) one for each vertex.
    opacity : 0..1, drawn in quarters: so many of each pixel's four samples are set.
    iris, decal : see `Iris`, `Decal`.
    """

    vertices: Floats
    triangles: Ints
    color: Floats
    normals: Floats | None = None
    gloss: float | Floats = 0.1
    opacity: float = 1.0
    iris: Iris | None = None
    decal: Decal | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "vertices", frozen(self.vertices, np.float64, (-1, 3)))
        put(self, "triangles", frozen(self.triangles, np.int32, (-1, 3)))
        put(self, "color", frozen(self.color, np.float64))
        if self.normals is not None:
            put(self, "normals", frozen(self.normals, np.float64, self.vertices.shape))
        if self.color.shape not in ((3,), (len(self.vertices), 3), (len(self.triangles), 3)):
            raise MeshError(
                f"colours of shape {self.color.shape} fit neither {len(self.vertices)} vertices "
                f"nor {len(self.triangles)} triangles"
            )


ATTRIBUTES = 7
"""Values that the pixel shader gets for each corner: normal (3), linear albedo (3), gloss (1)."""


def corner_attributes(drawable: Drawable, directions: Floats) -> Floats32:
    """Lay out what the pixel shader needs for each corner of each triangle.

    Parameters
    ----------
    directions : (3, 3) rotation from world to view.

    Returns
    -------
    (t, 3, 7) float32: view normal, albedo in linear light, gloss.
    """
    corners = drawable.triangles
    out = np.empty((len(corners), 3, ATTRIBUTES), dtype=np.float32)
    rotation = directions.T.astype(np.float32)
    if drawable.normals is not None:
        out[..., :3] = (drawable.normals.astype(np.float32) @ rotation)[corners]
    else:
        out[..., :3] = (triangle_normals(drawable.vertices, corners).astype(np.float32) @ rotation)[:, None]
    linear = (drawable.color**2).astype(np.float32)
    if linear.ndim == 1:
        out[..., 3:6] = linear
    elif len(linear) == len(drawable.vertices):
        out[..., 3:6] = linear[corners]
    else:
        out[..., 3:6] = linear[:, None]
    gloss = np.asarray(drawable.gloss, dtype=np.float32)
    out[..., 6] = gloss if gloss.ndim == 0 else gloss[corners]
    return out


def triangle_normals(vertices: Floats, triangles: Ints) -> Floats:
    """(t, 3) unit normals; zero for triangles without area."""
    cross = _crosses(vertices, triangles)
    length = np.sqrt(np.einsum("ij,ij->i", cross, cross))[:, None]
    unit: Floats = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    return unit


def _crosses(vertices: Floats, triangles: Ints) -> Floats:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    cross: Floats = np.stack(
        [
            u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1],
            u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2],
            u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0],
        ],
        axis=1,
    )
    return cross


def same_place(vertices: Floats) -> Ints:
    """Number the distinct positions: (n,) int32, equal for vertices that lie on exactly the same point.

    Files often split vertices at texture seams; smooth normals must not see these seams.
    """
    _, numbers = np.unique(vertices, axis=0, return_inverse=True)
    return frozen(numbers, np.int32, (-1,))


def smooth_normals(vertices: Floats, triangles: Ints, places: Ints | None = None) -> Floats:
    """Area-weighted unit normals of vertices.

    Parameters
    ----------
    vertices : (n, 3).
    triangles : (t, 3).
    places : (n,) as `same_place` gives for the rest pose: vertices of one place share their normal.

    Returns
    -------
    (n, 3); zero where a vertex has no triangle with area.
    """
    owner = triangles if places is None else places[triangles]
    count = len(vertices) if places is None else int(places.max(initial=-1)) + 1
    cross = _crosses(vertices, triangles)
    normals = np.empty((count, 3))
    flat = owner.T.ravel()
    for axis in range(3):
        normals[:, axis] = np.bincount(flat, np.tile(cross[:, axis], 3), count)
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    np.divide(normals, length, out=normals, where=length > 0)
    return normals if places is None else normals[places]
