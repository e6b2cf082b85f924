"""Colours of a face: the file's materials where it has some, natural colours by role where it has none."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from fba.arrays import Floats
from fba.mesh import Material
from fba.scene import FaceScene, Role, Shape
from studio.render.drawable import Iris

NATURAL: dict[Role, tuple[float, float, float]] = {
    Role.SKIN: (0.88, 0.70, 0.59),
    Role.EYE_LEFT: (0.95, 0.945, 0.93),
    Role.EYE_RIGHT: (0.95, 0.945, 0.93),
    Role.UPPER_TEETH: (0.94, 0.91, 0.84),
    Role.LOWER_TEETH: (0.94, 0.91, 0.84),
    Role.TONGUE: (0.78, 0.42, 0.41),
    Role.OTHER: (0.62, 0.62, 0.64),
}
BY_NAME: tuple[tuple[str, tuple[float, float, float]], ...] = (
    ("lash|brow|hair|beard", (0.20, 0.15, 0.12)),
    ("gum|palate|mouth[ _-]?(bag|socket|cavity|inside)", (0.74, 0.42, 0.41)),
    ("sclera|eyeball|eyes?[ _-]?(left|right|l|r)?$", (0.95, 0.945, 0.93)),
    ("iris", (0.36, 0.49, 0.57)),
    ("pupil", (0.04, 0.04, 0.05)),
    ("tooth|teeth", (0.94, 0.91, 0.84)),
    ("tongue", (0.78, 0.42, 0.41)),
    ("skin|head|neck|face|body", (0.88, 0.70, 0.59)),
)
"""Colours for parts that have no role but a telling name (of the shape, a group or a material)."""
CLEAR = re.compile("cornea|occlusion|lacrimal|tear|eyeblend|eye_blend|lens", re.IGNORECASE)
"""Clear films over the eye, which would hide it if they were painted."""

LASH_OPACITY = 0.25

GLOSS = {
    Role.SKIN: 0.055,
    Role.EYE_LEFT: 0.10,
    Role.EYE_RIGHT: 0.10,
    Role.UPPER_TEETH: 0.22,
    Role.LOWER_TEETH: 0.22,
    Role.TONGUE: 0.16,
    Role.OTHER: 0.02,
}
IRIS_ANGLE = 0.52
"""Half angle of a human iris (11.8 mm across) on its eyeball (24 mm across): asin(0.49)."""
NAMED = (Role.SKIN, Role.OTHER)
"""Roles of shapes in which one mesh may hold several parts, told apart by names of groups or materials."""
EYES = (Role.EYE_LEFT, Role.EYE_RIGHT)
_PLAIN = Material().diffuse


def with_skin(scene: FaceScene) -> tuple[Shape, ...]:
    """The scene's shapes; where none is known to be the skin, the largest one without a role is taken for it."""
    unknown = [s for s in scene.shapes if s.role is Role.OTHER]
    if scene.with_role(Role.SKIN) or not unknown:
        return scene.shapes
    largest = max(unknown, key=lambda s: s.mesh.face_count)
    return tuple(replace(s, role=Role.SKIN) if s is largest else s for s in scene.shapes)


def shape_colors(shape: Shape) -> Floats:
    """Colours of one shape: (3,), or (t, 3) where its faces differ."""
    mesh = shape.mesh
    if mesh.face_materials is not None and shape.materials:
        table = np.array([*(material_color(m, shape) for m in shape.materials), natural_color(shape.role, shape.name)])
        ids = np.where(mesh.face_materials >= 0, mesh.face_materials, len(shape.materials))
        used = np.unique(table[ids], axis=0)
        return used[0] if len(used) == 1 else table[ids][mesh.triangle_faces]
    if mesh.face_groups is not None and mesh.group_names and shape.role in NAMED:
        table = np.array([natural_color(shape.role, name) for name in mesh.group_names])
        ids = np.clip(mesh.face_groups, 0, len(table) - 1)
        return table[ids][mesh.triangle_faces]
    if len(shape.materials) == 1:
        return np.asarray(material_color(shape.materials[0], shape))
    return np.asarray(natural_color(shape.role, shape.name))


def material_color(material: Material, shape: Shape) -> tuple[float, float, float]:
    """The material's diffuse colour; a natural one where it says nothing: default grey, or a texture over white."""
    red, green, blue = material.diffuse
    says_nothing = material.diffuse == _PLAIN or (min(material.diffuse) > 0.99) or max(material.diffuse) < 0.01
    if says_nothing:
        return natural_color(shape.role, material.name or shape.name)
    return red, green, blue


def natural_color(role: Role, name: str) -> tuple[float, float, float]:
    """Colour by role; for a part of the skin or without role by its name, where that tells."""
    if role in NAMED:
        for pattern, color in BY_NAME:
            if re.search(pattern, name, re.IGNORECASE):
                return color
    return NATURAL[role]


def opacity(shape: Shape) -> float:
    """How solid a shape is drawn: lashes are strips that stand for separate hairs."""
    solid = 1.0 - max((m.transparency for m in shape.materials), default=0.0)
    return min(solid, LASH_OPACITY) if re.search("lash", shape.name, re.IGNORECASE) else solid


def is_clear(shape: Shape) -> bool:
    """True for films over the eye and for see-through shapes, which are not drawn."""
    if CLEAR.search(shape.name):
        return True
    return bool(shape.materials) and all(m.transparency > 0.85 or CLEAR.search(m.name) for m in shape.materials)


def clear_faces(shape: Shape) -> Floats | None:
    """(m,) 1.0 for the polygons of a mixed shape that are see-through; None where there are none."""
    ids = shape.mesh.face_materials
    if ids is None or not shape.materials:
        return None
    clear = np.array([m.transparency > 0.85 or bool(CLEAR.search(m.name)) for m in shape.materials] + [False])
    hidden = clear[np.where(ids >= 0, ids, len(shape.materials))]
    return hidden.astype(np.float64) if hidden.any() else None


def eye_iris(scene: FaceScene, shape: Shape, color: Floats) -> Iris | None:
    """Iris and pupil for an eyeball that has none of its own (faces of one colour only).

    The eye's gaze at rest is +Z, as in every neutral face of the standard; its centre is that of the sphere
    that fits its vertices best (their middle where they form no sphere).
    """
    if shape.role not in EYES or color.ndim != 1:
        return None
    vertices = scene.world_vertices(shape.name)
    used = vertices[shape.mesh.used_vertices]
    if len(used) < 4:
        return None
    return Iris(vertices - sphere_center(used), IRIS_ANGLE)


def sphere_center(points: Floats) -> Floats:
    """Centre (3,) of the algebraic least-squares sphere through (n, 3) points."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    local = points - middle
    size = float(np.abs(local).max()) or 1.0
    local = local / size
    system = np.concatenate([2.0 * local, np.ones((len(local), 1))], axis=1)
    solution, _, rank, _ = np.linalg.lstsq(system, np.einsum("ij,ij->i", local, local), rcond=1e-6)
    offset = solution[:3]
    if rank < 4 or np.linalg.norm(offset) > 2.0:
        offset = np.zeros(3)
    center: Floats = middle + offset * size
    return center
