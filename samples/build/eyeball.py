"""A sphere with rings where the pupil and the iris end, in place of MakeHuman's eyeball of eight segments."""

from __future__ import annotations

import numpy as np

from fba.arrays import Floats
from fba.mesh import PolyMesh

PUPIL_OF_IRIS = 1.0 / 3.0
"""MPEG-4's neutral pupil: a third of the iris diameter."""
SCLERA_RINGS = 7
SCLERA, IRIS, PUPIL = range(3)
"""Indices of the materials."""


def eyeball(center: Floats, radius: float, iris_radius: float, segments: int) -> PolyMesh:
    """Build an eyeball that looks along +Z.

    Returns
    -------
    Vertex 0 is the front pole (pupil centre); quads in rings, triangles at both poles.
    """
    iris = float(np.arcsin(iris_radius / radius))
    pupil = float(np.arcsin(PUPIL_OF_IRIS * iris_radius / radius))
    inner = [pupil, 0.5 * (pupil + iris), iris]
    angles = np.array([*inner, *np.linspace(iris, np.pi, SCLERA_RINGS + 2)[1:-1]])
    turn = np.arange(segments) * 2.0 * np.pi / segments
    rings = np.stack(
        [
            np.sin(angles)[:, None] * np.cos(turn),
            np.sin(angles)[:, None] * np.sin(turn),
            np.broadcast_to(np.cos(angles)[:, None], (angles.size, segments)),
        ],
        axis=-1,
    )
    unit = np.vstack([[0.0, 0.0, 1.0], rings.reshape(-1, 3), [0.0, 0.0, -1.0]])
    faces: list[list[int]] = []
    materials: list[int] = []
    last = angles.size - 1

    def at(ring: int, segment: int) -> int:
        return 1 + ring * segments + segment % segments

    for s in range(segments):
        faces.append([0, at(0, s), at(0, s + 1)])
        materials.append(PUPIL)
    for ring in range(last):
        for s in range(segments):
            faces.append([at(ring, s), at(ring + 1, s), at(ring + 1, s + 1), at(ring, s + 1)])
            materials.append(IRIS if ring < 2 else SCLERA)
    for s in range(segments):
        faces.append([at(last, s), len(unit) - 1, at(last, s + 1)])
        materials.append(SCLERA)
    mesh = PolyMesh.from_faces(np.asarray(center) + radius * unit, faces)
    return PolyMesh(mesh.vertices, mesh.indices, mesh.offsets, face_materials=np.asarray(materials, dtype=np.int32))
