"""The backends `vtc` and `vtc-image`: vertex tents on whole faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cloning.backends import find_backend
from cloning.local_transfer import BareTransfer, GoalTransfer
from cloning.prepare import PreparedFace
from cloning.resampling import resample
from cloning.source import source_motions
from cloning.transfer import build_face_transfer
from cloning.vtc_image import Transferred, build_published, transferred
from fat import AnimatableFace
from fba.arrays import Floats

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
def papers(mine: PreparedFace, yours: PreparedFace, motions: Floats) -> Transferred:
    return transferred(mine, yours, motions)


def test_the_papers_form_is_the_target_in_the_source_s_corrected_topology(
    mine: PreparedFace, yours: PreparedFace, papers: Transferred, motions: Floats
) -> None:
    m, k = papers.kept.sum(), motions.shape[1]
    assert papers.neutral.shape == (m, 3)
    assert papers.posed.shape == (m, k, 3)
    indices, offsets = papers.polygons
    assert set(np.unique(indices)) <= set(range(m))
    arities = np.unique(np.diff(offsets))
    assert arities.tolist() == np.unique(np.diff(mine.skin.polygons[1])).tolist(), "quadrangles stay quadrangles"
    size = np.ptp(papers.neutral, axis=0) / np.ptp(yours.skin.vertices * yours.fapu.es0, axis=0)
    assert np.all((size > 0.8) & (size < 1.01)), "it has the target's size and place"
    farthest = np.linalg.norm(papers.posed - papers.neutral[:, None], axis=2).max(axis=0)
    assert (farthest > 0.02 * yours.fapu.es0).all()
    assert (farthest < 1.5 * yours.fapu.es0).all()


def test_published_mode_is_the_papers(
    mine: PreparedFace, yours: PreparedFace, papers: Transferred, motions: Floats
) -> None:
    transfer, copy = build_published(mine, yours)
    assert np.array_equal(copy.kept, papers.kept)
    still = ~motions.any(axis=(1, 2))
    ready = transfer.anchored(np.linalg.norm(motions, axis=2).max(axis=1))
    assert isinstance(ready, BareTransfer)
    assert ready.solver is not None
    assert ready.solver.pulling.shape[1] == 0, "no feature point has a goal"
    held = (ready.solver.weld @ ready.solver.holding).diagonal() > 0.0
    assert held[still].all(), "what never moves is an anchor"
    assert held[copy.kept].mean() < still[copy.kept].mean() + 0.02, "and hardly anything else"
    offsets = ready.deform(motions)[copy.kept] * yours.fapu.es0
    assert np.allclose(papers.posed, papers.neutral[:, None] + offsets)
    whole = build_face_transfer(mine, yours, ready, True)
    whole.apply([mine.skin.split(motions[:, k]) for k in range(motions.shape[1])])
    assert whole.tally.after == whole.tally.before, "nothing is corrected"


def test_place_turn_and_size_of_the_target_do_not_matter(mine: PreparedFace) -> None:
    turn = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])
    skin = mine.skin
    moved = {key: 2.0 * (turn @ place) + 3.0 for key, place in skin.positions.items()}
    turned = replace(skin, vertices=2.0 * (skin.vertices @ turn.T) + 3.0, positions=moved)
    plain, other = resample(skin, skin), resample(skin, turned)
    assert np.allclose(other.alignment.rotation, turn.T)
    assert np.isclose(other.alignment.scale, 0.5)
    both = plain.kept & other.kept
    assert both.mean() > 0.98
    error = np.linalg.norm(other.vertices - (2.0 * (plain.vertices @ turn.T) + 3.0), axis=1)[both]
    assert np.percentile(error, 99) < 1e-6
