"""Ears, skull and corners of the jaw: pieces of the source's surface are laid onto the target with their points.

A fitted template slides along an ear, and the top of a skull has no edge that holds it. A whole ear or skull, moved,
turned, scaled and sheared as one piece, has enough relief to lie in one place only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cloning.detect.register import register
from cloning.detect.samples import Samples, sample
from cloning.detect.search import Pose
from cloning.detect.slices import Slicer
from cloning.surface import Surface
from cloning.template.closest import TriangleSearch
from fba.arrays import Bools, Floats

EARS = (("10.1", "10.3", "10.5", "10.7", "10.9"), ("10.2", "10.4", "10.6", "10.8", "10.10"))
"""Points of the left and of the right ear."""

CROWN = ("11.1", "11.4", "11.6")
TEMPLES = ("11.2", "11.3")
"""Points of the skull. The fit knows as much of the temples, which lie between brows and skull: both count the same."""

JAWS = (("2.13", "10.5", "10.7"), ("2.14", "10.6", "10.8"))
"""Corners of the jaw, and the ear lobe above them. On the side of the face the source's way from the lobe is kept."""

MARGIN = 0.12
"""How far an ear's patch reaches past its points, in eye separations: to where the ear joins the head."""

AROUND = 0.45
"""The same where the ear is sought on the target."""

INSIDE = (0.0, 0.3, -1.5)
"""A place in the middle of the skull, in eye separations from the middle between the eyes."""

BELOW, AHEAD, WIDE = 0.0, 0.2, 1.25
"""The skull lies above the eyes, behind the brows and between the ears."""

MORE = 0.35
"""How much farther down and ahead the skull is sought on the target."""

STEPS = 20

STIFF_EAR, STIFF_SKULL = 1e-4, 1e-3
"""How strongly a patch keeps its shape. An ear's relief holds it; a skull, nearly a ball, needs more to hold it.
Ten to a thousand times as much was
tried on two phenotypes, ICT-FaceKit and a MakeHuman body: ears want the softest, skulls the middle."""

FACING, REACH, KEPT = 0.5, 0.15, 0.85
"""Partners: cosine of their normals, distance in eye separations, and the share of the nearest that counts."""

SPACING = 0.05
"""Distance along the surface to the next sample that costs nothing, in eye separations."""

LAID = 0.06
"""A point of a patch lies on the target when it is this near, in eye separations."""

ENOUGH = 0.8
"""Share of a patch that lies on the target, at least: hair, helmets and masks have less."""

FEWEST = 40
"""A patch needs this many pairs."""

SIZES = (0.6, 1.6)
"""Determinant's cube root of a patch that was laid on something like it."""


@dataclass(frozen=True, eq=False)
class Laid:
    """How a patch lies on a target: x -> matrix @ x + shift, and the share of it that does."""

    matrix: Floats
    shift: Floats
    share: float

    @property
    def good(self) -> bool:
        """Whether it lies there as a thing of its kind."""
        size = float(np.cbrt(np.linalg.det(self.matrix)))
        return self.share > ENOUGH and SIZES[0] < size < SIZES[1]

    def apply(self, places: Floats) -> Floats:
        """Take (n, 3) places along."""
        moved: Floats = places @ self.matrix.T + self.shift
        return moved


def by_patches(
    skin: Surface, search: TriangleSearch, source: Surface, places: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Places of ears, skull and jaw corners, (3,) each; only those that the skin has.

    Parameters
    ----------
    skin : the target's.
    search : finds places on it.
    source : a face with all points, its triangles wound to the outside.
    places : of the target's points so far.
    """
    found: dict[str, Floats] = {}
    for ids in EARS:
        laid = _ear(skin, source, places, ids)
        if laid is not None and laid.good:
            found |= _carried(laid, source, ids)
    laid = _skull(skin, source)
    if laid is not None and laid.good:
        found |= _carried(laid, source, CROWN)
        temples = _carried(laid, source, TEMPLES)
        found |= {key: 0.5 * (place + places[key]) for key, place in temples.items() if key in places}
    if not found:
        return {}
    on = search.positions(search.closest(np.array(list(found.values()))))
    found = dict(zip(found, on, strict=True))
    return found | _jaws(skin, source.positions, found)


def lay(patch: Samples, target: Samples, start: Pose, stiff: float) -> Laid:
    """Lay a patch onto a target: iterated closest points, any affine map near the start.

    Parameters
    ----------
    start : takes the target to the patch's space, roughly.
    stiff : weight of the change of shape against all pairs.
    """
    first: Floats = start.turn.T / start.scale
    matrix, shift = first, -start.shift @ first.T
    middle = patch.points.mean(axis=0)
    for _ in range(STEPS):
        points, normals, partners, gap, good = _partners(patch, target, matrix, shift)
        if good.sum() < FEWEST:
            break
        good &= gap <= np.quantile(gap[good], KEPT)
        local, facing = patch.points[good] - middle, normals[good]
        rest = np.einsum("ij,ij->i", partners[good] - points[good], facing)
        turns = (facing[:, :, None] * local[:, None, :]).reshape(-1, 9)
        system = np.concatenate([turns, facing], axis=1)
        keep = stiff * len(local) * np.array([1.0] * 9 + [0.0] * 3)
        changed = np.concatenate([(matrix - first).ravel(), np.zeros(3)])
        damping = np.diag(keep + 1e-6 * len(local))
        step = np.linalg.solve(system.T @ system + damping, system.T @ rest - keep * changed)
        more = step[:9].reshape(3, 3)
        matrix, shift = matrix + more, shift + step[9:] - more @ middle
    _, _, _, gap, good = _partners(patch, target, matrix, shift)
    return Laid(matrix, shift, float((good & (gap < LAID)).mean()))


def _partners(
    patch: Samples, target: Samples, matrix: Floats, shift: Floats
) -> tuple[Floats, Floats, Floats, Floats, Bools]:
    """The moved points and normals, their nearest target points, how far these are, and which may count."""
    points = patch.points @ matrix.T + shift
    normals = patch.normals @ np.linalg.pinv(matrix)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    distance, nearest = target.tree.query(points)
    partners = target.points[nearest]
    gap = np.abs(np.einsum("ij,ij->i", partners - points, normals))
    gap = np.maximum(gap, distance - SPACING)
    facing = np.einsum("ij,ij->i", normals, target.normals[nearest])
    return points, normals, partners, gap, (facing > FACING) & (gap < REACH)


def _ear(skin: Surface, source: Surface, places: Mapping[str, Floats], ids: tuple[str, ...]) -> Laid | None:
    """Lay one ear: as a rigid piece of any size first, then with its shape."""
    if not all(key in places and key in source.positions for key in ids):
        return None
    own, guess = np.array([source.positions[key] for key in ids]), np.array([places[key] for key in ids])
    patch, target = _near(source, own, MARGIN, 500), _near(skin, guess, AROUND, 4000)
    if patch is None or target is None:
        return None
    start = Pose(np.eye(3), 1.0, own.mean(axis=0) - guess.mean(axis=0), 0.0)
    return lay(patch, target, register(patch, target, start, STEPS), STIFF_EAR)


def _near(surface: Surface, places: Floats, margin: float, count: int) -> Samples | None:
    """Samples of a surface in the box around some places."""
    centers = surface.vertices[surface.triangles].mean(axis=1)
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    return _some(surface, np.all((centers > low) & (centers < high), axis=1), count)


def _skull(skin: Surface, source: Surface) -> Laid | None:
    """Lay the skull, from where the face has been laid already."""
    patch, target = _crown(source, 0.0, 1500), _crown(skin, MORE, 12000)
    if patch is None or target is None:
        return None
    return lay(patch, target, Pose(np.eye(3), 1.0, np.zeros(3), 0.0), STIFF_SKULL)


def _crown(surface: Surface, more: float, count: int) -> Samples | None:
    """Samples of the outside of a skull."""
    corners = surface.vertices[surface.triangles]
    centers = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outside = np.einsum("ij,ij->i", normals, centers - INSIDE) > 0.0
    here = (centers[:, 1] > BELOW - more) & (centers[:, 2] < AHEAD + more) & (np.abs(centers[:, 0]) < WIDE)
    return _some(surface, outside & here, count)


def _some(surface: Surface, triangles: Bools, count: int) -> Samples | None:
    """Samples of some triangles; None where these are too few to be anything."""
    return sample(surface, count, np.flatnonzero(triangles)) if triangles.sum() >= FEWEST else None


def _carried(laid: Laid, source: Surface, ids: tuple[str, ...]) -> dict[str, Floats]:
    """The source's points on the laid patch."""
    here = [key for key in ids if key in source.positions]
    return dict(zip(here, laid.apply(np.array([source.positions[key] for key in here])), strict=True))


def _jaws(skin: Surface, own: Mapping[str, Floats], found: Mapping[str, Floats]) -> dict[str, Floats]:
    """The corners of the jaw, as far below and before the ear lobes as on the source, seen from the side."""
    jaws = {}
    for side, (key, *lobe) in zip((1.0, -1.0), JAWS, strict=True):
        if key not in own or not all(point in found for point in lobe):
            continue
        way = sum(found[point] - own[point] for point in lobe) / len(lobe)
        _, y, z = own[key] + way
        # From the side: x and z change places.
        turned = replace(skin, vertices=skin.vertices[:, [2, 1, 0]] * (1.0, 1.0, side))
        corner = np.array([z, y, side * own[key][0]])
        x = float(Slicer(turned, corner - 0.6, corner + 0.6, axis=1).at(float(y)).profile(np.array([z]))[0])
        if np.isfinite(x):
            jaws[key] = np.array([side * x, y, z])
    return jaws
