"""Facial Animation Tables: build, evaluate, validate."""

from __future__ import annotations

from fat.face import AnimatableFace
from fat.motion import FaceMotion
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform, TransformField, table_name

__all__ = [
    "AnimatableFace",
    "FaceDefMesh",
    "FaceDefTable",
    "FaceDefTables",
    "FaceDefTransform",
    "FaceMotion",
    "TransformField",
    "table_name",
]
