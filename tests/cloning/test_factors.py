"""Factors hold no more than they must."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, diags_array

from cloning.factors import factored
from cloning.refine import refine
from formats import read_scene
from samples import sample


def test_a_subdivided_head_is_factored_without_stored_zeros_and_solved() -> None:
    mesh = read_scene(sample("faces/closed_head.obj")).shapes[0].mesh
    indices, _ = refine(mesh.indices, mesh.offsets, mesh.vertex_count).polygons
    a, b, n = indices, np.roll(indices.reshape(-1, 4), -1, axis=1).ravel(), int(indices.max()) + 1
    graph = coo_array((np.ones(2 * len(a)), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)).tocsr()
    system = diags_array(1.0 + graph.sum(axis=1)) - graph
    factor = factored(system)
    assert factor.nnz == factor.L.nnz + factor.U.nnz
    truth = np.random.default_rng(0).normal(size=(n, 3))
    assert np.allclose(factor.solve(np.asfortranarray(system @ truth)), truth, rtol=0.0, atol=1e-10)
