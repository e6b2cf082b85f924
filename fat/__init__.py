"""Facial Animation Tables: build, evaluate, validate, measure."""

from __future__ import annotations

from fat.build import build_tables, face_motions
from fat.conformance import FapConformance, conformance
from fat.evaluate import Player, Pose
from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField, table_name
from fat.validate import validate

__all__ = [
    "AnimatableFace",
    "FaceDefMesh",
    "FaceDefTable",
    "FaceDefTables",
    "FaceDefTransform",
    "FaceMotion",
    "FapConformance",
    "Player",
    "Pose",
    "TransformField",
    "build_tables",
    "conformance",
    "face_motions",
    "table_name",
    "validate",
]
