"""From an open_jaw that opens the mouth to the standard's, which leaves the lips.

Subtracting the face's own lip FAPs from the jaw's motion would null it at their feature points only; the skin between
them gapes, and what lies below them folds. So the jaw's motion is faded out towards the lips instead, over the skin
from the chin up, on the outside and inside the mouth alike: lips closed, chin dropped, nothing in between folded.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from cloning.surface import Surface, build_surface
from fat.face import AnimatableFace
from fat.open_jaw import JAW, NOTE, open_jaw_mode
from fat.tables import FaceDefMesh, FaceDefTable, FaceDefTables
from fba.arrays import Floats
from fba.errors import FaceDefTablesError, LandmarkError

CONTOURS = (
    ("2.5", "2.7", "2.2", "2.6", "2.4"),
    ("2.5", "2.9", "2.3", "2.8", "2.4"),
    ("8.4", "8.6", "8.1", "8.5", "8.3"),
    ("8.4", "8.8", "8.2", "8.7", "8.3"),
)
"""Feature points along the inner and outer contours of the lips."""

CHIN = "2.1"
NECESSARY = (CHIN, "2.2", "2.3", "2.4", "2.5")
THICKNESS = (("8.1", "2.2"), ("8.2", "2.3"))


def strict(face: AnimatableFace) -> AnimatableFace:
    """Return the same face with an open_jaw that leaves the lips, as the standard has it.

    Jaw line, chin (2.1), teeth and tongue move as before; the feature points of the lips stay, whatever the value.
    A face whose lips stay already is returned with its note only.

    Raises
    ------
    FaceDefTablesError
        If the face has no table for FAP 3.
    LandmarkError
        If feature points of chin or lips are missing or do not lie on the same skin.
    """
    table = face.tables.get(JAW)
    if table is None:
        raise FaceDefTablesError("the face has no table for FAP 3 (open_jaw), so there is none to make strict")
    notes = {**face.notes, NOTE: "strict"}
    if open_jaw_mode(face) == "strict":
        return face if face.notes.get(NOTE) == "strict" else replace(face, notes=notes)
    surface = _skin(face)
    shares = surface.split(np.repeat(_shares(surface)[:, None], 3, axis=1))
    meshes = tuple(_faded(m, shares[m.shape]) if m.shape in shares else m for m in table.meshes)
    made = replace(table, meshes=tuple(m for m in meshes if m.coord_index.size))
    return replace(face, tables=_with(face.tables, made), notes=notes)


def _skin(face: AnimatableFace) -> Surface:
    """The shapes that carry chin and lips."""
    points = face.feature_points
    points.require(*NECESSARY, purpose="a strict open_jaw")
    named = {points[k].shape for k in NECESSARY}
    shapes = [s.name for s in face.scene.shapes if s.name in named]
    surface = build_surface(face.scene, points, shapes, face.fapu.es0)
    loose = [k for k in NECESSARY if k not in surface.points]
    if loose:
        raise LandmarkError(f"feature points {', '.join(loose)} do not lie on a surface; give them as vertices")
    return surface


def _shares(surface: Surface) -> Floats:
    """(n,) share of the jaw's motion that each vertex keeps: 0 on the lips, 1 from the chin on."""
    from scipy.sparse.csgraph import dijkstra

    seeds = sorted({v for contour in CONTOURS for v in _along(surface, contour)})
    away = dijkstra(surface.graph, indices=seeds, min_only=True)
    chin = float(away[surface.points[CHIN][0]].min())
    if not np.isfinite(chin):
        raise LandmarkError(f"feature point {CHIN} (chin) and the lips do not lie on one connected skin")
    gaps = [
        float(np.linalg.norm(surface.positions[a] - surface.positions[b])) for a, b in THICKNESS if a in surface.points
    ]
    # Half a lip from both contours, so that all of it stays.
    lip = min(0.5 * max(gaps, default=0.0), 0.5 * chin)
    part = np.clip((np.where(np.isfinite(away), away, chin) - lip) / (chin - lip), 0.0, 1.0)
    shares: Floats = part * part * (3.0 - 2.0 * part)
    return shares


def _along(surface: Surface, contour: tuple[str, ...]) -> set[int]:
    """Vertices of the feature points of a contour and of the shortest ways between them."""
    from scipy.sparse.csgraph import dijkstra

    keys = [k for k in contour if k in surface.points]
    found = {int(v) for k in keys for v in surface.points[k][0]}
    for a, b in pairwise(keys):
        start, stop = (int(v[np.argmax(w)]) for v, w in (surface.points[a], surface.points[b]))
        before = dijkstra(surface.graph, indices=np.array([start]), return_predecessors=True)[1][0]
        while stop != start and stop >= 0:
            found.add(stop)
            stop = int(before[stop])
    return found


def _faded(mesh: FaceDefMesh, shares: Floats) -> FaceDefMesh:
    slopes = (mesh.displacements * shares[mesh.coord_index][:, None, :]).astype(np.float32)
    moves = slopes.any(axis=(1, 2))
    return replace(mesh, coord_index=mesh.coord_index[moves], displacements=slopes[moves])


def _with(tables: FaceDefTables, made: FaceDefTable) -> FaceDefTables:
    return FaceDefTables(tuple(made if t.key == made.key else t for t in tables))
