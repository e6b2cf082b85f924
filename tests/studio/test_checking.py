"""The check finds what is wrong, and passes what is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from fat import AnimatableFace, FaceDefTables
from formats import read_face
from studio.checking import check_face
from studio.cli.app import app


@pytest.fixture(scope="module")
def source() -> AnimatableFace:
    return read_face("default")


def only(face: AnimatableFace, *faps: int) -> AnimatableFace:
    """The face with the tables of these FAPs alone."""
    return replace(face, tables=FaceDefTables(tuple(t for t in face.tables if t.fap_id in faps)))


def changed(face: AnimatableFace, fap_id: int, factor: float) -> AnimatableFace:
    """The face with the displacements of one FAP multiplied."""
    tables = []
    for table in face.tables:
        meshes = table.meshes
        if table.fap_id == fap_id:
            meshes = tuple(replace(m, displacements=m.displacements * np.float32(factor)) for m in meshes)
        tables.append(replace(table, meshes=meshes))
    return replace(face, tables=FaceDefTables(tuple(tables)))


FEW_OF_EACH = (3, 12, 19, 20, 23, 29, 35, 36, 44, 48, 66)
"""A FAP of each kind: jaw, lip, lids, eyeball, pupil, brows, tongue, head, ear."""


def test_a_face_passes_beside_itself(source: AnimatableFace) -> None:
    # That all motions of the shipped source keep their limits is tested with the source.
    few = only(source, *FEW_OF_EACH)
    high = tuple(t for t in source.tables if t.key in ((1, 10), (2, 1)))
    few = replace(few, tables=FaceDefTables((*high, *few.tables)))
    result = check_face(few, few)
    assert result.passed, [f.message for f in (*result.problems, *result.findings)]
    assert result.neutral_unchanged
    assert result.fidelity is not None
    assert result.fidelity.fp_error_worst == 0.0
    assert result.fidelity.lip_gap == 0.0
    assert result.fidelity.lid_gap == 0.0
    assert not [f for f in (*result.problems, *result.remarks) if f.code.startswith("fap-")]
    assert all(theirs is not None and theirs.key == mine.key for mine, theirs in result.compared)


def test_every_measure_of_a_face_beside_itself_is_told(source: AnimatableFace) -> None:
    few = only(source, 3, 4)
    told = check_face(few, few).to_dict()["measures"]
    assert isinstance(told, list)
    assert {m["word"] for m in told} <= {"good", "fair"}
    codes = {
        "own-fp",
        "fp-error",
        "held-out",
        "lip-gap",
        "lip-depth",
        "teeth",
        "lids",
        "tear",
        "bend",
        "noise",
        "still",
    }
    assert codes <= {m["code"] for m in told}
    assert all(m["source"] is not None for m in told if m["code"] in ("tear", "lids", "still"))


def test_a_picture_that_is_no_png_is_refused_before_the_work() -> None:
    done = CliRunner().invoke(app, ["check", "default", "--worst-picture", "worst.jpg"])
    assert done.exit_code == 2
    assert "--worst-picture worst.jpg: the picture is a .png" in done.output


def test_a_fap_that_moves_too_far_is_named(source: AnimatableFace) -> None:
    result = check_face(changed(only(source, 3, 12), 3, 1.02))
    assert not result.passed
    own = [f for f in result.problems if f.code == "own-fp"]
    assert [f.where for f in own] == ["FAP 3"]
    assert "open_jaw" in own[0].message


def test_lids_that_stay_open_and_a_mouth_that_opens_less_are_found(source: AnimatableFace) -> None:
    few = only(source, 3, 19, 20)
    lids = check_face(changed(few, 19, 0.7), few)
    assert {"lid-gap", "own-fp"} <= {f.code for f in lids.problems}
    jaw = check_face(changed(few, 3, 0.5), few)
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


def test_beside_its_source_a_face_is_told_only_what_is_worse(source: AnimatableFace) -> None:
    # A lip raised three times as far folds; by itself that is an error, beside the source a warning.
    few = only(source, 51, 57)
    wild = changed(few, 51, 3.0)
    alone, compared = check_face(wild), check_face(wild, few)
    assert "fap-flips" in {f.code for f in alone.problems if "lower_t_midlip_o" in f.where}
    assert {f.severity for f in compared.remarks if "lower_t_midlip_o" in f.where} == {"warning"}
    assert not [f for f in compared.problems if f.code.startswith("fap-")]
    data = alone.to_dict()
    assert [row["name"] for row in data["quality"]] == [row.name for row in alone.quality]  # type: ignore[attr-defined]
    assert data["source_quality"] is None
    assert {"own_error", "cross_talk", "flips", "stretch", "penetration", "asymmetry"} <= set(data["quality"][0])  # type: ignore[index]
