"""The MPEG-4 face model: FAPs, feature points, FAPUs, visemes, expressions, and the objects built on them."""

from __future__ import annotations

from fba.errors import FbaError
from fba.faps import Fap, Unit, fap, faps
from fba.fapu import Fapu
from fba.feature_points import FeaturePoint, FeaturePoints, feature_point_definitions, standard_feature_points
from fba.high_level import EXPRESSIONS, VISEMES, Expression, Viseme
from fba.mesh import Material, PolyMesh
from fba.scene import FaceScene, Frame, Role, Shape, Transform
from fba.shapes import ShapeSet
from fba.stream import FapStream

__version__ = "0.1.0"

__all__ = [
    "EXPRESSIONS",
    "VISEMES",
    "Expression",
    "FaceScene",
    "Fap",
    "FapStream",
    "Fapu",
    "FbaError",
    "FeaturePoint",
    "FeaturePoints",
    "Frame",
    "Material",
    "PolyMesh",
    "Role",
    "Shape",
    "ShapeSet",
    "Transform",
    "Unit",
    "Viseme",
    "fap",
    "faps",
    "feature_point_definitions",
    "standard_feature_points",
]
