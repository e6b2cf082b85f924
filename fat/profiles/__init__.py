"""Profiles: sets of shapes that other programs animate faces with, beside MPEG-4's FAPs."""

from __future__ import annotations

from fat.profiles.build import profile_shapes
from fat.profiles.names import ARKIT, OCULUS, VRM
from fat.profiles.tables import PROFILES, FapAsShapes, Profile, ProfileShape, faps_as_arkit, profile_table

__all__ = [
    "ARKIT",
    "OCULUS",
    "PROFILES",
    "VRM",
    "FapAsShapes",
    "Profile",
    "ProfileShape",
    "faps_as_arkit",
    "profile_shapes",
    "profile_table",
]
