"""Brows and lips painted on bare skin where the feature points say they are.

Face meshes rarely have colours; without them a raised brow can hardly be seen. The paint is laid on the neutral face
from the front and then belongs to the surface, so that it moves as the skin moves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from fba.arrays import Floats, Ints
from studio.render.drawable import Decal

OUTER_LIP = ("8.4", "8.6", "8.9", "8.1", "8.10", "8.5", "8.3", "8.7", "8.2", "8.8")
BROWS = (("4.1", "4.3", "4.5"), ("4.2", "4.4", "4.6"))
LIP_TINT = (0.93, 0.76, 0.76)
BROW_TINT = (0.56, 0.48, 0.43)
"""What the paint leaves of the skin's colour."""
BROW_HEIGHT = (0.040, 0.066, 0.055, 0.010)
"""Height of a brow from its inner to its outer end, in distances between the brows' outer ends and their middle."""
TEXELS = 512
FINE = 2


def feature_decal(places: Mapping[str, Floats], vertices: Floats, triangles: Ints, brows: bool = True) -> Decal | None:
    """Paint lips and brows for a skin.

    Parameters
    ----------
    places : feature point id -> (3,) world position on the neutral face.
    vertices, triangles : (n, 3) and (t, 3) of the skin at rest, world coordinates.
    brows : False where the scene has modelled ones.

    Returns
    -------
    None where the feature points of neither are there.
    """
    lips = [places[i] for i in OUTER_LIP if i in places]
    strips = [[places[i] for i in ids] for ids in BROWS if brows and all(i in places for i in ids)]
    if not {"8.1", "8.2", "8.3", "8.4"} <= places.keys():
        lips = []
    known = np.array([*lips, *(p for strip in strips for p in strip)])
    if len(known) == 0:
        return None
    low, high = known.min(axis=0), known.max(axis=0)
    size = high - low
    margin = 0.16 * float(size[:2].max())
    corner = np.array([low[0] - margin, high[1] + margin])
    scale = 1.0 / (float(size[:2].max()) + 2.0 * margin)
    depth = float(low[2]) - 0.22 * float(size[0])
    uv = np.stack([(vertices[:, 0] - corner[0]) * scale, (corner[1] - vertices[:, 1]) * scale], axis=1)
    corners = uv[triangles]
    # The back of the head lies behind the same places of the picture.
    corners[(vertices[:, 2] < depth)[triangles].any(axis=1)] = -1.0

    def flat(points: Sequence[Floats]) -> Floats:
        return np.array([[(p[0] - corner[0]) * scale, (corner[1] - p[1]) * scale] for p in points])

    image = np.ones((TEXELS, TEXELS, 3))
    if lips:
        _tint(image, _smooth_loop(flat(lips)), LIP_TINT, 0.012)
    for strip in strips:
        _tint(image, _brow(flat(strip), 0.5 * float(size[0]) * scale), BROW_TINT, 0.009)
    return Decal(np.rint(image * 255.0).astype(np.uint8), corners)


def _tint(image: Floats, outline: Floats, tint: tuple[float, float, float], softness: float) -> None:
    """Multiply the inside of an outline (k, 2) into the image; softness in widths of the image."""
    side = TEXELS * FINE
    mask = Image.new("L", (side, side))
    ImageDraw.Draw(mask).polygon([(float(x) * side, float(y) * side) for x, y in outline], fill=255)
    mask = mask.filter(ImageFilter.GaussianBlur(softness * side / 2.0)).reduce(FINE)
    amount = np.asarray(mask, dtype=np.float64)[..., None] / 255.0
    image *= 1.0 - amount * (1.0 - np.array(tint))


def _smooth_loop(points: Floats, steps: int = 8) -> Floats:
    """A closed Catmull-Rom curve through (k, 2) points."""
    before, after, last = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0), np.roll(points, -2, axis=0)
    return np.concatenate([_catmull_rom(*quad, steps) for quad in zip(before, points, after, last, strict=True)])


def _catmull_rom(a: Floats, b: Floats, c: Floats, d: Floats, steps: int) -> Floats:
    t = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    curve: Floats = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * (b - c) + d - a) * t**3)
    return curve


def _brow(points: Floats, unit: float) -> Floats:
    """Outline of a brow around the curve through its inner end, its top and its outer end (3, 2)."""
    inner, top, outer = points
    t = np.linspace(0.0, 1.0, 25)[:, None]
    # The parabola through the three points, each at its share of the length.
    rise, fall = float(np.linalg.norm(top - inner)), float(np.linalg.norm(outer - top))
    share = min(max(rise / max(rise + fall, 1e-12), 0.2), 0.8)
    bend = (top - inner - share * (outer - inner)) / (share * (share - 1.0))
    middle = inner + t * (outer - inner) + t * (t - 1.0) * bend
    heights = np.interp(t[:, 0], np.linspace(0.0, 1.0, len(BROW_HEIGHT)), BROW_HEIGHT) * unit
    across = np.stack([np.zeros_like(heights), heights], axis=1)
    return np.concatenate([middle - across, (middle + across)[::-1]])
