"""Compact tables: what goes straight loses its borders, what bends keeps them, nothing moves visibly."""

from __future__ import annotations

import numpy as np
import pytest
from literal_player import mesh_displacements

from fat.build import build_tables
from fat.compact import compact
from fat.motion import FaceMotion
from fat.tables import FaceDefTable, FaceDefTables
from fba import FaceScene, Fapu, PolyMesh, Shape
from fba.arrays import Floats

FAPU = Fapu(irisd0=0.11, es0=0.63, ens0=0.41, mns0=0.19, mw0=0.5)
UNIT = FAPU.mns0 / 1024
COUNT = 6
JAW = 3


def table(places: dict[int, Floats]) -> FaceDefTable:
    """Table of FAP 3 that brings six vertices to these offsets."""
    mesh = PolyMesh.from_faces(np.zeros((COUNT, 3)), [[0, 1, 2], [3, 4, 5]])
    scene = FaceScene((Shape("skin", mesh),))
    motions = [FaceMotion("open_jaw", JAW, 1, value, {"skin": offsets}) for value, offsets in places.items()]
    return build_tables(scene, FAPU, motions).tables[0]


def compacted(given: FaceDefTable, **limits: float) -> FaceDefTable:
    return compact(FaceDefTables((given,)), FAPU, **limits).tables[0]


def offsets(of: FaceDefTable, value: float) -> Floats:
    return np.sum([mesh_displacements(mesh, UNIT, value, COUNT) for mesh in of.meshes], axis=0)


def arc(value: float, bends: np.ndarray) -> Floats:
    """Down in proportion to the value; forwards with its square where it bends."""
    out = np.zeros((COUNT, 3))
    out[:, 1] = -0.1 * value / 1000
    out[:, 2] = bends * (value / 1000) ** 2
    return out


def test_straight_motion_keeps_its_ends_only() -> None:
    given = table({v: arc(v, np.zeros(COUNT)) for v in (-500, -250, 250, 500, 1000)})
    (mesh,) = compacted(given).meshes
    assert mesh.interval_borders.tolist() == [-500, 0, 1000]


def test_vertices_that_bend_keep_borders_of_their_own() -> None:
    bends = np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.05])
    values = (125, 250, 375, 500, 625, 750, 875, 1000)
    given = table({v: arc(v, bends) for v in values})
    straight, bent = compacted(given).meshes
    assert (straight.coord_index.tolist(), bent.coord_index.tolist()) == ([0, 1, 2], [3, 4, 5])
    assert straight.interval_borders.tolist() == [0, 1000]
    assert set(straight.interval_borders.tolist()) < set(bent.interval_borders.tolist()) < {0, *values} | {-1}


@pytest.mark.parametrize("values", [(250, 500, 750, 1000), (-600, -300, 300, 600), (-1000, -500), (300,), (-300,)])
@pytest.mark.parametrize("unseen", [0.0, 0.005, 0.05])
def test_no_vertex_leaves_its_way_by_more_than_allowed(values: tuple[int, ...], unseen: float) -> None:
    bends = np.array([0.0, 1e-4, 1e-3, 1e-2, 0.05, -0.05])
    given = table({v: arc(v, bends) for v in values})
    made = compacted(given, unseen=unseen, small=0.0)
    assert sorted(i for mesh in made.meshes for i in mesh.coord_index.tolist()) == list(range(COUNT))
    for value in (*given.meshes[0].interval_borders.tolist(), 2 * values[-1]):
        inside = given.meshes[0].interval_borders[0] <= value <= given.meshes[0].interval_borders[-1]
        wanted = offsets(given, value)
        allowed = unseen * np.linalg.norm(wanted, axis=1).max() + 2e-7 * FAPU.es0
        if inside or not unseen:
            assert np.linalg.norm(offsets(made, value) - wanted, axis=1).max() <= (1 if inside else 4) * allowed


def test_small_misses_are_allowed_everywhere() -> None:
    """A bend of 0.0025 at 500 is 5 % of the motion there, but three thousandths of an eye separation."""
    given = table({v: arc(v, np.full(COUNT, 0.01)) for v in (500, 1000)})
    assert len(compacted(given, small=0.0).meshes[0].interval_borders) == 3
    assert len(compacted(given, small=0.005).meshes[0].interval_borders) == 2


def test_borders_that_are_kept_are_exact_to_the_rounding() -> None:
    values = (250, 500, 750, 1000)
    given = table({v: arc(v, np.linspace(0.0, 0.3, COUNT)) for v in values})
    made = compacted(given, unseen=0.02, small=0.0, rounding=1e-5)
    for mesh in made.meshes:
        for border in mesh.interval_borders.tolist():
            missed = mesh_displacements(mesh, UNIT, border, COUNT) - offsets(given, border)
            assert np.abs(missed[mesh.coord_index]).max() <= 4e-5 * FAPU.es0


def test_rounded_numbers_are_short() -> None:
    given = table({1000: arc(1000, np.linspace(0.01, 0.3, COUNT) / 7)})
    (mesh,) = compacted(given, rounding=1e-5).meshes
    words = [str(x) for x in mesh.displacements.ravel()]
    assert max(len(word.removeprefix("-")) for word in words) == len("0.12345")
