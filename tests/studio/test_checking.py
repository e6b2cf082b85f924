"""The check finds what is wrong, and passes what is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fat import AnimatableFace, FaceDefTables
from formats import read_face
from studio.checking import check_face


@pytest.fixture(scope="module")
def source() -> AnimatableFace:
    return read_face("default")


def changed(face: AnimatableFace, fap_id: int, factor: float) -> AnimatableFace:
    """The face with the displacements of one FAP multiplied."""
    tables = []
    for table in face.tables:
        meshes = table.meshes
        if table.fap_id == fap_id:
            meshes = tuple(replace(m, displacements=m.displacements * np.float32(factor)) for m in meshes)
        tables.append(replace(table, meshes=meshes))
    return replace(face, tables=FaceDefTables(tuple(tables)))


def test_the_shipped_source_passes_beside_itself(source: AnimatableFace) -> None:
    result = check_face(source, source)
    assert result.passed, [f.message for f in (*result.problems, *result.findings)]
    assert result.neutral_unchanged
    assert result.fidelity is not None
    assert result.fidelity.fp_error_worst == 0.0
    assert result.fidelity.lip_gap == 0.0
    assert result.fidelity.lid_gap == 0.0


def test_a_fap_that_moves_too_far_is_named(source: AnimatableFace) -> None:
    result = check_face(changed(source, 3, 1.02))
    assert not result.passed
    own = [f for f in result.problems if f.code == "own-fp"]
    assert [f.where for f in own] == ["FAP 3"]
    assert "open_jaw" in own[0].message


def test_lids_that_stay_open_and_a_mouth_that_opens_less_are_found(source: AnimatableFace) -> None:
    lids = check_face(changed(source, 19, 0.7), source)
    assert {"lid-gap", "own-fp"} <= {f.code for f in lids.problems}
    jaw = check_face(changed(source, 3, 0.5), source)
    assert {"lip-gap", "own-fp"} <= {f.code for f in jaw.problems}


def test_tables_that_cannot_be_played_are_reported_and_not_measured(source: AnimatableFace) -> None:
    table = source.tables.tables[-1]
    broken = replace(table, transforms=tuple(replace(t, transform="nowhere") for t in table.transforms))
    if not table.transforms:
        broken = replace(table, meshes=(replace(table.meshes[0], shape="nowhere"),))
    tables = FaceDefTables((*source.tables.tables[:-1], broken))
    result = check_face(replace(source, tables=tables))
    assert not result.passed
    assert result.faps == ()
    assert any("nowhere" in f.message for f in result.findings)
