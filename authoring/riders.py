"""What rides on the skin, such as lashes and brows that are meshes of their own, follows the skin's motion."""

from __future__ import annotations

from weakref import WeakKeyDictionary

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
    es0 = face.fapu.es0
    out = dict(face.skin.split(field))
    for name, binding in _bindings(face).items():
        out[name] = binding.apply(field[:, None])[:, 0]
    return {name: es0 * part for name, part in out.items() if abs(part).max(initial=0.0) > STILL}


_KNOWN: WeakKeyDictionary[PreparedFace, dict[str, Binding]] = WeakKeyDictionary()


def _bindings(face: PreparedFace) -> dict[str, Binding]:
    if face not in _KNOWN:
        _KNOWN[face] = {
            s.name: Binding(
                face.scene.world_vertices(s.name) / face.fapu.es0, s.mesh.indices, s.mesh.offsets, face.skin
            )
            for s in face.scene.with_role(Role.OTHER)
            if s.mesh.vertex_count
        }
    return _KNOWN[face]
