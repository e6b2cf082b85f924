"""An animatable face: a scene, its feature points and its Facial Animation Tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fat.tables import FaceDefTables
from fba.fapu import Fapu
from fba.feature_points import FeaturePoints
from fba.scene import FaceScene


@dataclass(frozen=True, eq=False)
class AnimatableFace:
    """What a source is, and what cloning returns.

    Attributes
    ----------
    fapu : the units that the tables' displacements are multiplied with.
    notes : short facts that travel with the file, e.g. ``{"open_jaw": "practical", "generator": ...}``.
    """

    scene: FaceScene
    feature_points: FeaturePoints
    tables: FaceDefTables
    fapu: Fapu
    notes: Mapping[str, str] = field(default_factory=dict)
