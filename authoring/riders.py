"""What rides on the skin, such as lashes and brows that are meshes of their own, follows the skin's motion."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from authoring.construction import Offsets
from cloning.bind import Binding
from cloning.prepare import PreparedFace
from fba.arrays import Floats
from fba.scene import Role

STILL = 1e-7
"""Offsets shorter than this, in eye separations, are rounding."""


def skin_offsets(face: PreparedFace, field: Floats) -> Offsets:
    """Offsets of the skin's shapes, and of what rides on them.

    Parameters
    ----------
    field : (n, 3) motion of the joined skin, in eye separations.

    Returns
    -------
    Shape name -> (n_s, 3) offsets in mesh units; shapes that stay still are absent.
    """
    return in_mesh_units(face, {**face.skin.split(field), **carried(face, field)})


def in_mesh_units(face: PreparedFace, motion: Offsets) -> Offsets:
    """Offsets given in eye separations as the contract has them; shapes that stay still are left out."""
    es0 = face.fapu.es0
    return {name: es0 * part for name, part in motion.items() if np.abs(part).max(initial=0.0) > STILL}


def carried(face: PreparedFace, field: Floats) -> dict[str, Floats]:
    """What a field (n, 3) over the joined skin is on each shape that rides on it, (n_s, 3)."""
    return {name: binding.apply(field[:, None])[:, 0] for name, binding in _bindings(face).items()}


_KNOWN: WeakKeyDictionary[PreparedFace, dict[str, Binding]] = WeakKeyDictionary()


def _bindings(face: PreparedFace) -> dict[str, Binding]:
    if face not in _KNOWN:
        es0 = face.fapu.es0
        _KNOWN[face] = {
            s.name: Binding(face.scene.world_vertices(s.name) / es0, s.mesh.indices, s.mesh.offsets, face.skin)
            for s in face.scene.with_role(Role.OTHER)
            if s.mesh.vertex_count
        }
    return _KNOWN[face]
