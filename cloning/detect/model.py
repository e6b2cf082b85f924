"""A source's face made ready, once, for all faces that are looked for with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from cloning.detect.head import Model, face_model, part
from cloning.detect.rules import by_rule
from cloning.prepare import PreparedFace
from cloning.surface import Surface, build_surface
from cloning.visibility import visible
from fba.arrays import Bools, Floats
from fba.feature_points import FeaturePoints
from fba.scene import Role

HEAD, FACE = (-2.7, -10.0), (-2.2, -1.0)
"""y and z, in eye separations from the eyes, below which a template ends: in the neck, since necks differ in length
and end anywhere; for the first fit before the ears, which the rules do not need."""

PULLED = 1600
"""Vertices of a template that look for partners. Bending carries the others: four times as many place no point better
(errors within 0.002 eye widths on five heads) and take twice the time."""


@dataclass(frozen=True, eq=False)
class FaceTemplate:
    """A part of a source's skin.

    Attributes
    ----------
    surface : the part.
    pulled : (n,) bool, vertices that look for partners.
    share : how many of those that could do so.
    """

    surface: Surface
    pulled: Bools
    share: float


@dataclass(frozen=True, eq=False)
class Source:
    """A source's face, the middle between its pupils at the origin.

    Attributes
    ----------
    skin : with all feature points.
    model : what is searched.
    face, head : templates of the face alone and of the whole head.
    offsets : (3,) from where a rule sees a point on the source to where it is.
    """

    skin: Surface
    model: Model
    face: FaceTemplate
    head: FaceTemplate
    offsets: Mapping[str, Floats]


_READY: WeakKeyDictionary[PreparedFace, Source] = WeakKeyDictionary()


def ready(source: PreparedFace) -> Source:
    """The source made ready; the same one on every call."""
    if source not in _READY:
        skin = _centred(source.skin)
        outside = _outside(source)
        ruled = by_rule(skin, skin.positions)
        _READY[source] = Source(
            skin,
            face_model(skin),
            _template(skin, outside, FACE),
            _template(skin, outside, HEAD),
            {key: skin.positions[key] - place for key, place in ruled.items()},
        )
    return _READY[source]


def _centred(skin: Surface) -> Surface:
    """A source's skin with the middle between its pupils at the origin."""
    middle = 0.5 * (skin.positions["3.5"] + skin.positions["3.6"])
    positions = {key: place - middle for key, place in skin.positions.items()}
    return replace(skin, vertices=skin.vertices - middle, positions=positions)


def _outside(source: PreparedFace) -> Bools:
    """Which of the skin's vertices are seen; eyeballs, teeth and tongue hide what lies behind them."""
    roles = (Role.EYE_LEFT, Role.EYE_RIGHT, Role.UPPER_TEETH, Role.LOWER_TEETH, Role.TONGUE)
    names = [s.name for role in roles for s in source.scene.with_role(role)]
    joined = build_surface(source.scene, FeaturePoints({}), [*source.skin.shapes, *names], source.fapu.es0)
    return visible(joined)[: source.skin.vertex_count]


def _template(skin: Surface, outside: Bools, lowest: tuple[float, float]) -> FaceTemplate:
    """What of the source's skin is seen, and what holds feature points: the rest finds no partner.

    Parameters
    ----------
    lowest : y and z below which the template ends.
    """
    wanted = outside & np.all(skin.vertices[:, 1:] > lowest, axis=1)
    for vertices, _ in skin.points.values():
        wanted[vertices] = True
    indices, offsets = skin.polygons
    surface, ids = part(skin, np.maximum.reduceat(wanted[indices], offsets[:-1]))
    seen = np.flatnonzero(outside[ids])
    pulled = np.zeros(len(ids), bool)
    pulled[np.random.default_rng(0).permutation(seen)[:PULLED]] = True
    return FaceTemplate(surface, pulled, min(1.0, PULLED / max(len(seen), 1)))
