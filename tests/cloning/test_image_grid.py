"""Tents on pictures: the closed forms against the printed equations, solved densely."""

from __future__ import annotations

import numpy as np
import pytest

from cloning.image import grid, multigrid, solve
from cloning.image.grid import SIDES, Tents, motion_rows, tent_equations, wanted_differences
from cloning.image.solve import EDGE_WEIGHT, PixelSystem, around
from fba.arrays import Bools, Floats
from fba.errors import CloningError


def plane(seed: int, size: int = 9) -> Floats:
    rng = np.random.default_rng(seed)
    return 1.5 * rng.standard_normal((size, size))


def differences(heights: Floats) -> Floats:
    """(4, h - 2, w - 2) differences in the rings of all inner pixels."""
    at = np.arange(heights.size).reshape(heights.shape)[1:-1, 1:-1]
    return grid.differences(heights, at)


def tents(heights: Floats) -> Tents:
    return grid.tents(differences(heights))


def at_tents(inner: Floats, domain: Bools) -> Floats:
    """Of values (..., h - 2, w - 2) of inner pixels those (..., n) of the tents that touch a domain."""
    rows, columns = np.divmod(around(domain), domain.shape[1])
    return inner[..., rows - 1, columns - 1]


def omega(heights: Floats, row: int, column: int) -> Floats:
    """(3, 5) ring and tip of one pixel as the paper defines them; the normal is that of four quadrangles' corners."""
    ring = np.array([[c, r, heights[row + r, column + c] - heights[row, column]] for r, c in SIDES], np.float64)
    east, west, south, north = ring
    normal = sum(np.cross(a, b) for a, b in ((east, south), (south, west), (west, north), (north, east)))
    normal /= np.linalg.norm(normal)
    return np.concatenate([ring, [np.linalg.norm(ring, axis=1).mean() * normal]]).T


def printed(w: Floats) -> Floats:
    return w.T @ np.linalg.inv(w @ w.T)


def test_transforms_are_those_of_the_paper() -> None:
    one, other = plane(0), plane(1)
    found = motion_rows(tents(one), tents(other))
    for row, column in ((1, 1), (4, 3), (7, 7)):
        q = omega(other, row, column) @ printed(omega(one, row, column))
        assert [part[row - 1, column - 1] for part in found] == pytest.approx(q[2], abs=1e-12)


def test_eliminating_the_tips_leaves_the_minimum_as_it_is() -> None:
    source, moved, target = plane(2, 7), plane(3, 7), plane(4, 7)
    domain = np.zeros((7, 7), bool)
    domain[2:5, 2:5] = True
    unknown = {tuple(at): k for k, at in enumerate(np.argwhere(domain))}
    inner = [(r, c) for r in range(1, 6) for c in range(1, 6)]
    rows, right = [], []
    for k, (r, c) in enumerate(inner):
        q = omega(moved, r, c) @ printed(omega(source, r, c))
        p = printed(omega(target, r, c))
        for axis in range(3):
            line, known = np.zeros(len(unknown) + len(inner)), 0.0
            line[len(unknown) + k] = p[4, axis]
            for (dr, dc), weight in zip(SIDES, p[:4, axis], strict=True):
                for at, sign in (((r + dr, c + dc), 1.0), ((r, c), -1.0)):
                    if at in unknown:
                        line[unknown[at]] += sign * weight
                    else:
                        known += sign * weight * target[at]
            rows.append(line)
            right.append(q[2, axis] - known)
    tent = tents(target)
    coefficients, _ = tent_equations(tent)
    wanted = wanted_differences(tent, motion_rows(tents(source), tents(moved)), tent.ring) - tent.ring
    number = np.full(domain.shape, -1)
    for at, k in unknown.items():
        number[at] = k
    dense, right_dense = [], []
    for a in range(2):
        for r, c in inner:
            line = np.zeros(len(unknown))
            for k, (dr, dc) in enumerate(SIDES):
                for at, sign in (((r + dr, c + dc), 1.0), ((r, c), -1.0)):
                    if number[at] >= 0:
                        line[number[at]] += sign * coefficients[a, k, r - 1, c - 1]
            dense.append(line)
            right_dense.append(coefficients[a, :, r - 1, c - 1] @ wanted[:, r - 1, c - 1])
    with_tips = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0][: len(unknown)]
    without = np.linalg.lstsq(np.array(dense), np.array(right_dense), rcond=None)[0] + target[domain]
    assert without == pytest.approx(with_tips, abs=1e-9)


def test_a_face_gives_itself_its_own_differences() -> None:
    neutral, expression = plane(5), plane(6)
    tent = tents(neutral)
    motion = motion_rows(tent, tents(expression))
    assert wanted_differences(tent, motion, differences(expression)) == pytest.approx(differences(expression), abs=1e-9)
    still = np.broadcast_to(np.reshape([0.0, 0.0, 1.0], (3, 1, 1)), (3, *motion[0].shape))
    assert np.array(motion_rows(tent, tent)) == pytest.approx(still, abs=1e-12)


def disc(size: int) -> tuple[Bools, Tents]:
    y, x = np.mgrid[:size, :size] - size / 2.0 + 0.5
    return x**2 + y**2 < (0.45 * size) ** 2, tents(np.cumsum(0.3 * plane(7, size), axis=1))


def test_known_pixels_stay_and_unknown_ones_are_found() -> None:
    domain, tent = disc(40)
    change = np.where(domain, plane(8, 40), 0.0)
    system = PixelSystem(domain, at_tents(tent_equations(tent)[0], domain))
    found, steps = system.solve(at_tents(differences(change), domain))
    assert found == pytest.approx(change, abs=1e-5 * np.abs(change).max())
    assert steps == 0


def test_a_multigrid_finds_what_the_factor_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    domain, tent = disc(90)
    coefficients, wanted = (at_tents(of, domain) for of in (tent_equations(tent)[0], differences(plane(9, 90))))
    exact, _ = PixelSystem(domain, coefficients).solve(wanted)
    monkeypatch.setattr(solve, "DIRECT", 100)
    monkeypatch.setattr(multigrid, "COARSEST", 300)
    found, steps = PixelSystem(domain, coefficients).solve(wanted)
    assert 2 < steps < 40
    assert np.abs(found - exact).max() < 5e-3 * np.abs(exact).max()
    monkeypatch.setattr(solve, "STEPS", 1)
    with pytest.raises(CloningError, match="did not converge"):
        PixelSystem(domain, coefficients).solve(wanted)


def test_single_differences_bind_a_checkerboard() -> None:
    domain, _ = disc(30)
    flat = tent_equations(tents(np.zeros((30, 30))))[0]
    board = np.where(domain, (-1.0) ** np.add.outer(np.arange(30), np.arange(30)), 0.0)
    ring = differences(board)
    inside = domain[1:-1, 1:-1] & (np.abs(ring) == 2.0).all(axis=0)
    assert np.einsum("akij,kij->aij", flat, ring)[:, inside] == pytest.approx(0.0, abs=1e-12)
    found, _ = PixelSystem(domain, at_tents(flat, domain)).solve(at_tents(ring, domain))
    assert found == pytest.approx(board, abs=1e-5)
    assert 0.0 < EDGE_WEIGHT < 0.25
