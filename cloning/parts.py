"""Which mesh is skin, eye, teeth, tongue: found from feature points, and cut apart where a file has one mesh."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cloning.kinds import Kind, named
from cloning.pieces import Pieces, find_pieces
from fba.arrays import Floats
from fba.feature_points import FeaturePoint, FeaturePoints
from fba.findings import Finding
from fba.scene import FaceScene, Node, Role, Shape, Transform
from fba.sphere import fit_sphere

PUPILS = {"3.5": Role.EYE_LEFT, "3.6": Role.EYE_RIGHT}
UPPER_TEETH = ("9.8", "9.10")
LOWER_TEETH = ("9.9", "9.11")
TONGUE = ("6.1", "6.2", "6.3", "6.4")
INSIDE = (*PUPILS, *UPPER_TEETH, *LOWER_TEETH, *TONGUE)
"""Feature points that do not lie on the skin."""


EYE_NAMES = r"eye ?balls?|\beyes?\b(?! ?(lid|socket|shadow|line|brow|lash))|cornea|\biris|sclera"
TEETH_NAMES = r"teeth|tooth|denture|\bgums?\b|gingiva"
TONGUE_NAMES = r"tongue"
UPPER_NAMES, LOWER_NAMES = r"upper|\btop|maxill", r"lower|bottom|mandib|\bjaw"
"""Words by which files call the parts, see `cloning.pieces.words`."""

NEAR_PUPIL = 0.3
"""A piece called an eye has its middle at most this far from a pupil, in eye separations."""


def split_parts(scene: FaceScene, points: FeaturePoints) -> tuple[FaceScene, FeaturePoints, list[Finding]]:
    """Give every shape a role, and cut shapes that hold several parts into one shape for each role.

    Skin is what carries most feature points, together with every other piece that carries one of the skin's, but
    for glasses. Eyes are the pieces around the pupils 3.5 and 3.6, cornea and iris layers included; teeth and tongue
    are found by their feature points, upper teeth first. What feature points do not find is found by what the file
    calls it. Everything else stays "other". A scene that already has a skin keeps its roles.

    Parameters
    ----------
    scene : inside axes.

    Returns
    -------
    scene : same vertices in the same file order (a cut shape's parts carry `vertex_ids`).
    points : renamed to the new shapes.
    findings : parts that were looked for and are not there.
    """
    if scene.with_role(Role.SKIN):
        return scene, points, missing_parts(scene)
    pieces = find_pieces(scene)
    roles = _roles(scene, points, pieces)
    change: dict[str, tuple[Shape, ...]] = {}
    moved: dict[str, dict[int, tuple[str, int]]] = {}
    taken = {node.name for node, _ in scene.walk()}
    order = scene.file_order()
    for shape in scene.shapes:
        of_vertex = np.array([roles[k].value for k in pieces.of_vertex[shape.name]], dtype=object)
        found = [role for role in Role if np.any(of_vertex == role.value)]
        used = shape.mesh.used_vertices
        present = [role for role in found if np.any(used & (of_vertex == role.value))] or found[:1]
        if len(present) == 1:
            change[shape.name] = (replace(shape, role=present[0]),)
            continue
        of_vertex[~used] = present[0].value
        parts = []
        where = moved.setdefault(shape.name, {})
        for role in present:
            mesh, ids = shape.mesh.submesh(of_vertex == role.value)
            name = free_name(f"{shape.name}_{role.value}", taken)
            parts.append(Shape(name, mesh, role, shape.materials, order[shape.name][ids]))
            where.update({int(i): (name, k) for k, i in enumerate(ids)})
        change[shape.name] = tuple(parts)
    scene = replace(scene, roots=_replaced(scene.roots, change))
    points = FeaturePoints({key: _renamed(p, moved) for key, p in points.items()})
    return scene, points, missing_parts(scene)


def missing_parts(scene: FaceScene) -> list[Finding]:
    """Say in plain words which parts a face does not have and what will not move."""
    said = {
        Role.EYE_LEFT: "no left eyeball was found as a mesh of its own; FAPs 23, 25, 27 and 29 do not move anything",
        Role.EYE_RIGHT: "no right eyeball was found as a mesh of its own; FAPs 24, 26, 28 and 30 do not move anything",
        Role.UPPER_TEETH: "no upper teeth were found; nothing is shown where the mouth opens above",
        Role.LOWER_TEETH: "no lower teeth were found; the jaw moves the skin alone",
        Role.TONGUE: "no tongue was found; FAPs 43 to 47 do not move anything",
    }
    severity = {Role.UPPER_TEETH: "info"}
    return [
        Finding(severity.get(role, "warning"), f"no-{role.value.replace('_', '-')}", text, scene.name)  # type: ignore[arg-type]
        for role, text in said.items()
        if not scene.with_role(role)
    ]


def eye_center(vertices: Floats, pupil: Floats | None) -> Floats:
    """Centre of rotation of an eyeball: of the sphere that fits its vertices, (3,).

    An eye made of several layers or with an open back still fits. Where the sphere is off, that of the front alone is
    taken (a half ball with a flat back), and where that is off too (a flat disc), the centre of the bounding box.
    """
    middle: Floats = 0.5 * (vertices.max(axis=0) + vertices.min(axis=0))
    half = 0.5 * float(np.max(vertices.max(axis=0) - vertices.min(axis=0)))
    front = vertices[vertices[:, 2] > middle[2]]
    for some, most in ((vertices, 0.15), (front, 0.05)):
        if len(some) < 4:
            continue
        center, radius, error = fit_sphere(some)
        far = pupil is not None and float(np.linalg.norm(pupil - center)) > 2.5 * radius
        if not far and error <= most * radius and 0.5 * half <= radius <= 2.0 * half:
            return center
    return middle


def _roles(scene: FaceScene, points: FeaturePoints, pieces: Pieces) -> list[Role]:
    """The role of each piece."""
    roles = [Role.OTHER] * len(pieces.vertices)
    held = {
        key: int(pieces.of_vertex[p.shape][p.vertices[int(np.argmax(p.weights))]])
        for key, p in points.items()
        if p.shape is not None
    }
    votes = np.bincount([k for key, k in held.items() if key not in INSIDE], minlength=len(roles))
    main = int(np.argmax(votes))
    for k in np.flatnonzero(votes).tolist():
        if k == main or named(pieces.names[k]) is not Kind.GLASSES:
            roles[k] = Role.SKIN
    positions = points.positions(scene)
    for ids, role in ((UPPER_TEETH, Role.UPPER_TEETH), (LOWER_TEETH, Role.LOWER_TEETH), (TONGUE, Role.TONGUE)):
        for key in ids:
            if key in held and roles[held[key]] is Role.OTHER and _may_be(role, pieces.names[held[key]]):
                roles[held[key]] = role
    for pupil, role in PUPILS.items():
        if pupil in positions:
            _mark_eye(positions[pupil], held.get(pupil), role, roles, pieces, main)
    _mark_named(positions, roles, pieces)
    _grow_teeth(roles, pieces)
    return roles


def _may_be(role: Role, name: str) -> bool:
    """False where the file calls tongue what a point takes for teeth."""
    return role is Role.TONGUE or re.search(TONGUE_NAMES, name) is None


def _mark_eye(pupil: Floats, piece: int | None, role: Role, roles: list[Role], pieces: Pieces, main: int) -> None:
    """Mark the eyeball below a pupil and the layers around the same centre."""
    if piece is None or piece == main:
        near = [
            (float(np.min(np.linalg.norm(v - pupil, axis=1))), k)
            for k, v in enumerate(pieces.vertices)
            if roles[k] is Role.OTHER and len(v) >= 12 and _ball(v)
        ]
        near = [(d, k) for d, k in near if d < fit_sphere(pieces.vertices[k])[1]]
        if not near:
            return
        piece = min(near)[1]
    elif roles[piece] is Role.SKIN:
        return
    roles[piece] = role
    center, radius, _ = fit_sphere(pieces.vertices[piece])
    for k, v in enumerate(pieces.vertices):
        if roles[k] is not Role.OTHER or len(v) < 4:
            continue
        away = np.linalg.norm(v - center, axis=1)
        layer = _ball(v) and np.linalg.norm(fit_sphere(v)[0] - center) < 0.3 * radius
        if away.max() < 1.25 * radius and (layer or away.max() < 1.02 * radius):
            roles[k] = role


def _mark_named(positions: Mapping[str, Floats], roles: list[Role], pieces: Pieces) -> None:
    """Eyes, teeth and tongue that are called so, where no feature point has found them."""
    free = [k for k, role in enumerate(roles) if role is Role.OTHER and len(pieces.vertices[k]) >= 4]
    middles = {k: 0.5 * (pieces.vertices[k].min(axis=0) + pieces.vertices[k].max(axis=0)) for k in free}
    es = float(np.linalg.norm(positions["3.5"] - positions["3.6"]))
    for pupil, role in PUPILS.items():
        if role not in roles:
            for k in free:
                close = float(np.linalg.norm((middles[k] - positions[pupil])[:2])) < NEAR_PUPIL * es
                if close and named(pieces.names[k]) is None and re.search(EYE_NAMES, pieces.names[k]):
                    roles[k] = role
    line = 0.5 * float(positions["2.2"][1] + positions["2.3"][1])
    for k in free:
        name = pieces.names[k]
        if roles[k] is Role.OTHER and re.search(TEETH_NAMES, name) and not re.search(TONGUE_NAMES, name):
            lower = middles[k][1] < line
            if re.search(UPPER_NAMES, name) or re.search(LOWER_NAMES, name):
                lower = re.search(UPPER_NAMES, name) is None
            roles[k] = Role.LOWER_TEETH if lower else Role.UPPER_TEETH
    if Role.TONGUE not in roles:
        for k in free:
            if roles[k] is Role.OTHER and re.search(TONGUE_NAMES, pieces.names[k]):
                roles[k] = Role.TONGUE


def _ball(vertices: Floats) -> bool:
    """True for vertices on a sphere that they cover to a good part."""
    if len(vertices) < 12:
        return False
    _, radius, error = fit_sphere(vertices)
    sides = np.ptp(vertices, axis=0)
    return bool(error < 0.12 * radius and sides.min() > 0.5 * radius and radius < 1.2 * sides.max())


def _grow_teeth(roles: list[Role], pieces: Pieces) -> None:
    """Give single teeth and gums beside a known tooth to the nearer jaw."""
    known = {
        role: [v for v, r in zip(pieces.vertices, roles, strict=True) if r is role]
        for role in (Role.UPPER_TEETH, Role.LOWER_TEETH)
    }
    both = [v for some in known.values() for v in some]
    if not both:
        return
    tooth = np.concatenate(both)
    size = max(float(np.ptp(tooth, axis=0).max()), 1e-30)
    while True:
        grown = False
        for k, v in enumerate(pieces.vertices):
            if roles[k] is not Role.OTHER or named(pieces.names[k]) is not None:
                continue
            best = min(
                (
                    (_gap(v, w) + 2.0 * abs(float(v[:, 1].mean() - w[:, 1].mean())), _gap(v, w), role, w)
                    for role, some in known.items()
                    for w in some
                ),
                key=lambda row: row[0],
            )
            if best[1] < 0.3 * size and abs(v[:, 1].mean() - best[3][:, 1].mean()) < 0.6 * size and _compact(v, size):
                roles[k] = best[2]
                known[best[2]].append(v)
                grown = True
        if not grown:
            return


def _compact(vertices: Floats, size: float) -> bool:
    return len(vertices) >= 4 and float(np.ptp(vertices, axis=0).max()) < 3.0 * size


def _gap(a: Floats, b: Floats) -> float:
    """Distance between two bounding boxes."""
    apart = np.maximum(np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)), 0.0)
    return float(np.linalg.norm(apart))


def _renamed(point: FeaturePoint, moved: Mapping[str, Mapping[int, tuple[str, int]]]) -> FeaturePoint:
    if point.shape is None or point.shape not in moved:
        return point
    places = [moved[point.shape].get(v) for v in point.vertices]
    strongest = places[int(np.argmax(point.weights))]
    assert strongest is not None
    kept = [(p[1], w) for p, w in zip(places, point.weights, strict=True) if p is not None and p[0] == strongest[0]]
    total = 1.0 if len(kept) == len(places) else sum(w for _, w in kept)
    return replace(
        point, shape=strongest[0], vertices=tuple(v for v, _ in kept), weights=tuple(w / total for _, w in kept)
    )


def _replaced(nodes: tuple[Node, ...], change: Mapping[str, tuple[Shape, ...]]) -> tuple[Node, ...]:
    out: list[Node] = []
    for node in nodes:
        if isinstance(node, Transform):
            out.append(replace(node, children=_replaced(node.children, change)))
        else:
            out += change.get(node.name, (node,))
    return tuple(out)


def free_name(name: str, taken: set[str]) -> str:
    """A name that is not taken, made from this one; it is taken then."""
    number, free = 2, name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    taken.add(free)
    return free
