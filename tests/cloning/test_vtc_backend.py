"""The backends `vtc` and `vtc-image`: vertex tents on whole faces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cloning.backends import find_backend
from cloning.local_transfer import BareTransfer, GoalTransfer
from cloning.prepare import PreparedFace
from cloning.resampling import resample
from cloning.source import source_motions
from cloning.transfer import build_face_transfer
from fat import AnimatableFace
from fat.evaluate import Player
from fba.arrays import Bools, Floats
from fba.scene import Role
from formats import read_face
from samples import sample
from studio.cli.app import app

FEW = (3, 5, 12, 19, 31)


@pytest.fixture(scope="module")
def motions(source: AnimatableFace, mine: PreparedFace) -> Floats:
    """(n, K, 3) a few motions of the source's skin."""
    return np.stack([mine.skin.join(m.offsets) for m in source_motions(source, frozenset(FEW))], axis=1)


def test_feature_points_are_near_before_the_correction_and_exact_after_it(
    mine: PreparedFace, yours: PreparedFace, motions: Floats
) -> None:
    transfer = find_backend("vtc").build(mine, yours, False)
    assert isinstance(transfer, GoalTransfer)
    whole = build_face_transfer(mine, yours, transfer, False)
    whole.apply([mine.skin.split(motions[:, k]) for k in range(motions.shape[1])])
    measures = whole.tally.measures()
    assert measures["fp_error_before"] < 0.03
    assert measures["fp_error_after"] < 0.004
    assert transfer.measures["unmatched_share"] < 0.02


@pytest.fixture(scope="module")
def papers(mine: PreparedFace, yours: PreparedFace) -> tuple[PreparedFace, BareTransfer]:
    """The target in the source's topology, and its transfer."""
    face, transfer = find_backend("vtc").build_published(mine, yours)
    assert isinstance(transfer, BareTransfer)
    return face, transfer


def test_the_papers_form_is_the_target_in_the_source_s_corrected_topology(
    mine: PreparedFace, yours: PreparedFace, papers: tuple[PreparedFace, BareTransfer], motions: Floats
) -> None:
    face, transfer = papers
    copy = resample(mine.skin, yours.skin)
    number = np.cumsum(copy.kept) - 1
    assert np.allclose(face.skin.vertices, copy.vertices[copy.kept], atol=1e-12)
    assert np.array_equal(face.skin.polygons[0], number[copy.polygons[0]])
    assert np.array_equal(face.skin.polygons[1], copy.polygons[1]), "quadrangles stay quadrangles"
    mesh = face.scene.with_role(Role.SKIN)[0].mesh
    assert np.array_equal(np.unique(mesh.indices), np.arange(mesh.vertex_count)), "every vertex has a tent"
    size = np.ptp(face.skin.vertices, axis=0) / np.ptp(yours.skin.vertices, axis=0)
    assert np.all((size > 0.8) & (size < 1.01)), "it has the target's size and place"
    moved = np.linalg.norm(transfer.apply(motions), axis=2).max(axis=0)
    assert (moved > 0.02 * yours.fapu.es0).all()
    assert (moved < 1.5 * yours.fapu.es0).all()


def test_the_papers_form_is_a_whole_face(yours: PreparedFace, papers: tuple[PreparedFace, BareTransfer]) -> None:
    face, _ = papers
    assert face.fapu is yours.fapu
    assert list(face.points) == list(yours.points)
    for role in (Role.EYE_LEFT, Role.EYE_RIGHT, Role.LOWER_TEETH, Role.TONGUE):
        assert [s.name for s in face.scene.with_role(role)] == [s.name for s in yours.scene.with_role(role)]
    off = {i: np.linalg.norm(face.place(i) - yours.place(i)) / yours.fapu.es0 for i in face.skin.points}
    assert len(off) > 40
    assert np.median(list(off.values())) < 0.01
    assert off["9.3"] < 0.01
    assert off["8.3"] < 0.03


def test_published_mode_is_the_papers(
    mine: PreparedFace, yours: PreparedFace, papers: tuple[PreparedFace, BareTransfer], motions: Floats
) -> None:
    face, transfer = papers
    copy = resample(mine.skin, yours.skin)
    still = np.linalg.norm(motions, axis=2).max(axis=1) == 0.0
    ready = transfer.anchored(np.linalg.norm(motions, axis=2).max(axis=1))
    assert ready.solver is not None
    assert ready.solver.pulling.shape[1] == 0, "no feature point has a goal"
    held = (ready.solver.weld @ ready.solver.holding).diagonal() > 0.0
    assert held[still].all(), "what never moves is an anchor"
    assert held[copy.kept].mean() < still[copy.kept].mean() + 0.02, "and hardly anything else"
    whole = build_face_transfer(mine, face, ready, True)
    whole.apply([mine.skin.split(motions[:, k]) for k in range(motions.shape[1])])
    assert whole.tally.after == whole.tally.before, "nothing is corrected"


def test_free_shapes_are_carried_back_to_the_targets_own_vertices(
    mine: PreparedFace, yours: PreparedFace, papers: tuple[PreparedFace, BareTransfer], motions: Floats
) -> None:
    back = find_backend("vtc-image").build(mine, yours, True)
    assert isinstance(back, BareTransfer)
    found = back.apply(motions[:, :2])
    assert found.shape == (yours.skin.vertex_count, 2, 3)
    face, transfer = papers
    tip = [np.argmin(np.linalg.norm(f.skin.vertices - f.skin.positions["9.3"], axis=1)) for f in (yours, face)]
    assert np.linalg.norm(found[tip[0]] - transfer.apply(motions[:, :2])[tip[1]]) < 0.02 * yours.fapu.es0


@pytest.fixture(scope="module")
def kept(mine: PreparedFace) -> Bools:
    """(n,) what the source's own mesh image shows of it."""
    return resample(mine.skin, mine.skin).kept


def test_a_face_onto_itself_gives_its_own_motion_in_its_own_topology(
    mine: PreparedFace, motions: Floats, kept: Bools
) -> None:
    face, transfer = find_backend("vtc-image").build_published(mine, mine)
    assert face.skin.vertex_count == kept.sum()
    error = np.abs(transfer.apply(motions) - motions[kept]).max()
    assert error < 1e-6 * np.linalg.norm(motions, axis=2).max()


def test_place_turn_and_size_of_the_target_do_not_matter(mine: PreparedFace) -> None:
    turn = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])
    skin = mine.skin
    moved = {key: 2.0 * (turn @ place) + 3.0 for key, place in skin.positions.items()}
    turned = replace(skin, vertices=2.0 * (skin.vertices @ turn.T) + 3.0, positions=moved)
    plain, other = resample(skin, skin), resample(skin, turned)
    assert np.allclose(other.alignment.rotation, turn.T)
    assert np.isclose(other.alignment.scale, 0.5)
    both = plain.kept & other.kept
    assert (plain.kept == other.kept).mean() > 0.98
    error = np.linalg.norm(other.vertices - (2.0 * (plain.vertices @ turn.T) + 3.0), axis=1)[both]
    assert np.percentile(error, 99) < 1e-6


def test_the_command_line_writes_the_papers_form_as_a_face_that_plays(mine: PreparedFace, tmp_path: Path) -> None:
    out = tmp_path / "paper.wrl"
    words = ["clone", str(sample("faces/tri_head.obj")), "-o", str(out), "--backend", "vtc", "--faps", "3,12"]
    result = CliRunner().invoke(app, [*words, "--as-published"])
    assert result.exit_code == 0, result.output
    assert "the skin has the source's polygons" in " ".join(result.output.split())
    face = read_face(out)
    skin = face.scene.with_role(Role.SKIN)[0]
    arities = np.diff(skin.mesh.offsets)
    assert set(arities) <= {4, 5, 6, 7}, "the source's; the target is of triangles"
    assert 0.6 * len(mine.skin.polygons[1]) < len(arities) < len(mine.skin.polygons[1])
    rest, open_mouth = (Player(face).pose(values).world_shapes()[skin.name] for values in ({}, {3: 600}))
    assert np.array_equal(rest, face.scene.world_vertices(skin.name))
    assert np.linalg.norm(open_mouth - rest, axis=1).max() > 0.2 * face.fapu.es0


def test_what_the_mesh_image_shows_of_a_face_gets_its_own_motion_back(
    mine: PreparedFace, motions: Floats, kept: Bools
) -> None:
    found = find_backend("vtc-image").build(mine, mine, False).apply(motions)
    error = np.abs(found - motions)[kept].max()
    assert error < 1e-6 * np.linalg.norm(motions, axis=2).max()
