"""Facial expression analogy in pictures: the source's expression on the target's face (Song et al., section VI)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cloning.image.align import Similarity2D
from cloning.image.color import Planes, UInt8, is_grey, luminance, relit, to_rgb, to_yuv
from cloning.image.eri import ratio_image
from cloning.image.mask import (
    bounds,
    face_mask,
    mouth_opening,
    region_share,
    slit_mask,
    widened,
)
from cloning.image.picture import AnalogyResult, Picture
from cloning.image.points import (
    EYES,
    MOUTH,
    Places,
    eye_separation,
    face_points,
    moved_points,
    refined,
    source_to_target,
    to_array,
    turned,
)
from cloning.image.sampler import Sampler, part_around
from cloning.image.texture import without_foreign_texture
from cloning.image.transfer import TentTransfer
from cloning.image.warp import WarpMesh, covered, label_pixels, mapped, ring_around, triangulate
from fba.arrays import Bools, Floats, Ints

Method = Literal["vtc", "eri"]
METHODS: tuple[Method, ...] = ("vtc", "eri")

RELIEF = 0.02
"""Height of white over black in the image grid, in eye separations: the scale between luminance and pixels. It does
not depend on the size of the picture. docs/analogy.md says what it does and how it was chosen."""

SHUT, PARTED = 0.07, 0.03
"""Gap up to which lips count as shut, and by how much an expression must open them, in widths of the mouth. Detected on
the shared photographs, shut lips have gaps up to 0.06, lips that show teeth from 0.08 on."""


@dataclass(frozen=True, eq=False)
class _Warp:
    """Everything geometric about one expression, on the pixels of the box.

    `mask` says how much a pixel follows the source, `skin` is 0 within the eyes, which keep the target's look, `face`
    how much the warped face covers the target's picture. `expression` are the mesh's corners in the source's picture,
    of which `shrink` pixels become one.
    """

    mesh: WarpMesh
    expression: Floats
    shrink: float
    moved: Places
    labels: Ints
    mask: Planes
    skin: Planes
    face: Planes


class Analogy:
    """One source and one target, ready for any number of expressions.

    Parameters
    ----------
    source, target : neutral faces.
    expressions : points of all expressions to come: they say how far the target's face will reach.
    method : vtc, or eri for expression ratio images.
    teeth : show the source's mouth where it opens and neither neutral face shows teeth.
    relief : see `RELIEF`.
    as_published : vtc prints the source's texture on the target as well; see `cloning.image.texture`.

    Raises
    ------
    LandmarkError
        If points are missing, or a face is too small.

    Examples
    --------
    >>> analogy = Analogy(neutral, target, [smiling.points])                              # doctest: +SKIP
    >>> analogy.apply(smiling).rgb                                                        # doctest: +SKIP
    """

    def __init__(
        self,
        source: Picture,
        target: Picture,
        expressions: Sequence[Places],
        method: Method = "vtc",
        teeth: bool = True,
        relief: float = RELIEF,
        as_published: bool = False,
    ) -> None:
        self.method, self.teeth, self.as_published = method, teeth, as_published
        self._names = face_points(target.points, source.points, *expressions)
        self._source = {n: source.points[n] for n in self._names}
        self._target = {n: target.points[n] for n in self._names}
        self._fine_source, self._fine_target = refined(self._source), refined(self._target)
        self._picture = target.rgb
        self._yuv = to_yuv(target.rgb).astype(np.float32)
        self._grey = is_grey(target.rgb)
        self._unit = eye_separation(target.points)
        self._across = source_to_target(self._source, self._target, self._names)
        self._sharp, self._colours = Sampler(self._yuv[0]), Sampler(self._yuv[1:], 1)
        self._neutral = Sampler(luminance(source.rgb), shrink=1.0 / self._across.scale)
        fine = [refined(self._moved(points)) for points in expressions]
        self._box = self._box_of(fine)
        self._domain = self._domain_of(fine)
        self._near = widened(self._domain)
        self._inside = bounds(self._domain)
        self._resting = region_share(self._target, self._unit, self._box)
        self._tents = TentTransfer(self._domain[self._inside], relief * self._unit / 255.0)

    @property
    def unknowns(self) -> int:
        """Pixels whose luminance is solved for."""
        return int(self._domain.sum())

    def apply(self, expression: Picture) -> AnalogyResult:
        """Give the target the source's expression.

        Parameters
        ----------
        expression : a picture of the source, its points among those given before.

        Raises
        ------
        LandmarkError
            If points are missing.
        """
        face_points({n: self._target[n] for n in self._names}, expression.points)
        warp = self._warp(expression.points)
        warped, displaced = self._warped_target(warp)
        asked = (warp.mask > 0) | self._near
        pair = self._source_pair(warp, asked, expression)
        light = relit(*pair, (warp.mask > 0.5) & (warp.skin > 0.99))
        steps = self._relight(warped[0], warp, asked, *pair)
        shown = self.teeth and self._opens(expression.points, warp.moved)
        if shown:
            displaced |= self._show_mouth(warped, warp, expression)
        rgb, whole, changed = self._pasted(warped, warp.face, displaced | (warp.mask > 0))
        head = turned(self._source, expression.points, self._names)
        return AnalogyResult(rgb, whole, changed, dict(warp.moved), steps, shown, head, light)

    def _relight(self, warped: Planes, warp: _Warp, asked: Bools, neutral: Planes, posed: Planes) -> int:
        """Give the warped target's luminance the source's change, and tell the steps that took."""
        if self.method == "eri":
            warped *= 1.0 + warp.skin * warp.mask * (ratio_image(neutral, posed, self._unit) - 1.0)
            return 0
        inside = self._inside
        target, neutral, posed = warped[inside], neutral[inside], posed[inside]
        if not self.as_published:
            seen = np.where(asked[inside] & (warp.labels[inside] >= 0), target, np.float32(0.0))
            posed = without_foreign_texture(neutral, posed, seen, self._unit)
        change, steps = self._tents.change(target, neutral, posed, warp.mask[inside])
        target += warp.skin[inside] * change
        return steps

    def _pasted(self, warped: Planes, face: Planes, moved: Bools) -> tuple[UInt8, Planes, Bools]:
        """The picture, its luminance, and where it changed: what moved in the face's region, over the target."""
        rows, columns = self._box
        here, still = warped.reshape(3, -1), self._yuv[:, rows, columns].reshape(3, -1)
        border = np.flatnonzero((face < 1.0) & moved)
        rest = 1.0 - face.ravel().take(border)
        for plane, other in zip(here, still, strict=True):
            mixed = plane.take(border)
            plane[border] = mixed + rest * (other.take(border) - mixed)
        inside = moved & (face > 0)
        changed = np.zeros(self._picture.shape[:2], bool)
        changed[rows, columns] = inside
        rgb, whole = self._picture.copy(), self._yuv[0].copy()
        for channel, found in zip(
            rgb[rows, columns].T, to_rgb(here.take(np.flatnonzero(inside), axis=1)).T, strict=True
        ):
            channel.T[inside] = found
        whole[rows, columns] = warped[0]
        return rgb, whole, changed

    def _moved(self, expression: Places) -> dict[str, tuple[float, float]]:
        return moved_points(self._source, expression, self._target, self._names)

    def _box_of(self, faces: list[dict[str, tuple[float, float]]]) -> tuple[slice, slice]:
        """The pixels that some expression may warp."""
        height, width = self._picture.shape[:2]
        still = to_array(self._fine_target, list(self._fine_target))
        rings = [ring_around(np.concatenate([to_array(f, list(f)), still]), (width, height)) for f in faces]
        low, high = np.min([r.min(axis=0) for r in rings], axis=0), np.max([r.max(axis=0) for r in rings], axis=0)
        first, last = np.maximum(np.floor(low).astype(int) - 2, 0), np.ceil(high).astype(int) + 3
        return slice(int(first[1]), min(int(last[1]), height)), slice(int(first[0]), min(int(last[0]), width))

    def _domain_of(self, faces: list[dict[str, tuple[float, float]]]) -> Bools:
        """The pixels that some mask lets change; the border of the box stays."""
        domain: Bools = np.any([face_mask(face, self._box) > 0 for face in faces], axis=0)
        inner = np.zeros_like(domain)
        inner[2:-2, 2:-2] = domain[2:-2, 2:-2]
        return inner

    def _warp(self, expression: Places) -> _Warp:
        places = self._moved(expression)
        moved = refined(places)
        mesh = triangulate(moved, self._fine_target, self._picture.shape[1::-1])
        labels = label_pixels(mesh, self._box)
        mask = np.where(self._domain & (labels >= 0), face_mask(moved, self._box), np.float32(0.0))
        skin = 1.0 - slit_mask(mesh, labels, moved, EYES)
        face = np.maximum(self._resting, region_share(places, self._unit, self._box))
        own = {n: expression[n] for n in self._names}
        across = source_to_target(own, self._target, self._names)
        corners = _corners(mesh, refined(own), across)
        return _Warp(mesh, corners, 1.0 / across.scale, moved, labels, mask, skin, face)

    def _warped_target(self, warp: _Warp) -> tuple[Planes, Bools]:
        """Planes of the warped target in the box, and which pixels the warp moved."""
        pixels = covered(warp.labels, (warp.face > 0) | self._near, self._box)
        goals = np.concatenate([to_array(self._fine_target, warp.mesh.names), warp.mesh.ring])
        places = mapped(warp.mesh.affine(goals), pixels)
        off = (np.abs(places[0] - pixels.x) > 1e-6) | (np.abs(places[1] - pixels.y) > 1e-6)
        moved = np.flatnonzero(off)
        at, places = pixels.at.take(moved), places.take(moved, axis=1)
        planes = self._yuv[:, self._box[0], self._box[1]].copy()
        y, u, v = planes.reshape(3, -1)
        y[at] = self._sharp.at(places)
        u[at], v[at] = self._colours.at(places)
        displaced = np.zeros(warp.labels.shape, bool)
        displaced.ravel()[at] = True
        return planes, displaced

    def _source_pair(self, warp: _Warp, asked: Bools, expression: Picture) -> tuple[Planes, Planes]:
        """Luminance of the source's two pictures at the pixels of the warped target; zero where nothing is asked."""
        pixels = covered(warp.labels, asked, self._box)
        pair = np.zeros((2, *warp.labels.shape), np.float32)
        neutral, posed = pair.reshape(2, -1)
        still = _corners(warp.mesh, self._fine_source, self._across)
        neutral[pixels.at] = self._neutral.at(mapped(warp.mesh.affine(still), pixels))
        rgb, moved = part_around(expression.rgb, mapped(warp.mesh.affine(warp.expression), pixels), warp.shrink)
        posed[pixels.at] = Sampler(luminance(rgb), shrink=warp.shrink).at(moved)
        return pair[0], pair[1]

    def _opens(self, expression: Places, moved: Places) -> bool:
        """True where lips part that both neutral faces keep shut."""
        still = max(mouth_opening(self._source), mouth_opening(self._target))
        return still < SHUT and still + PARTED < min(mouth_opening(expression), mouth_opening(moved))

    def _show_mouth(self, warped: Planes, warp: _Warp, expression: Picture) -> Bools:
        """Put the source's pixels between the lips, and say where."""
        share = slit_mask(warp.mesh, warp.labels, warp.moved, MOUTH) * (warp.labels >= 0)
        shown = share > 0
        pixels = covered(warp.labels, shown, self._box)
        if len(pixels.at):
            here, flat = share.ravel().take(pixels.at), warped.reshape(3, -1)
            rgb, places = part_around(expression.rgb, mapped(warp.mesh.affine(warp.expression), pixels), warp.shrink)
            inside = Sampler(to_yuv(rgb), 1, warp.shrink).at(places)
            if self._grey:
                inside[1:] = 0.0
            outside = flat.take(pixels.at, axis=1)
            flat[:, pixels.at] = outside + here * (inside - outside)
        return shown


def _corners(mesh: WarpMesh, fine: Places, across: Similarity2D) -> Floats:
    """The mesh's corners in a picture of the source; the ring is carried over by the alignment to the target."""
    return np.concatenate([to_array(fine, mesh.names), across.inverse().apply(mesh.ring)])
