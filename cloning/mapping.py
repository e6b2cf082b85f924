"""Where each vertex of a target's skin lies on the source: the correspondence, to be looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cloning.backends import find_backend
from cloning.prepare import PreparedFace, prepare
from fat.face import AnimatableFace
from fat.rig import unrig
from fba.arrays import Floats
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene


@dataclass(frozen=True, eq=False)
class SkinPlaces:
    """A face whose skin knows its place on the source.

    Attributes
    ----------
    scene, points : the face, inside axes, every shape with its role.
    places : skin shape -> (n, 3) places of its vertices on the source, about the source's nose tip, in the source's
        eye separations.
    """

    scene: FaceScene
    points: FeaturePoints
    places: Mapping[str, Floats]


def map_skin(
    source: AnimatableFace, target: AnimatableFace, *, backend: str, as_published: bool = False
) -> tuple[SkinPlaces, SkinPlaces]:
    """Find the place on the source of every vertex of a target's skin.

    Parameters
    ----------
    source, target : faces with feature points; the target may be the source's clone.
    backend, as_published : as for `cloning.clone.clone_with_report`.

    Returns
    -------
    source, target : the source with its own places, and the target with those that the backend gives it.
    """
    mine = prepare(unrig(source), source.feature_points, "source")
    yours = prepare(unrig(target), target.feature_points, "target")
    transfer = find_backend(backend).build(mine, yours, as_published)
    places = mine.skin.vertices - mine.skin.positions["9.3"]
    return _placed(mine, places), _placed(yours, transfer.carry(places))


def _placed(face: PreparedFace, places: Floats) -> SkinPlaces:
    return SkinPlaces(face.scene, face.points, face.skin.split(places))
