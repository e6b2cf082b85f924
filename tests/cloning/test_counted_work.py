"""How much work a clone is, counted: factorisations, right-hand sides, closest points, bytes.

Seconds depend on the machine, counts do not: they grow only when somebody makes the program do more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

import pytest
import scipy.sparse.linalg

from cloning import clone
from cloning.prepare import PreparedFace
from cloning.source import source_motions
from cloning.template.balls import Balls
from cloning.template.closest import TriangleSearch
from fat.face import AnimatableFace
from formats import read_scene, write
from formats.landmarks import read_landmarks
from samples import sample


class CountedFactor:
    """A factor that counts the columns it solves."""

    def __init__(self, factor: Any, size: int, counts: Counter[str]) -> None:
        self._factor, self._size, self._counts = factor, size, counts

    def __getattr__(self, name: str) -> Any:
        return getattr(self._factor, name)

    def solve(self, right: Any, *more: Any) -> Any:
        columns = 1 if right.ndim == 1 else right.shape[1]
        self._counts["right-hand sides"] += columns
        self._counts[f"right-hand sides of {self._size}"] += columns
        return self._factor.solve(right, *more)


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    found: Counter[str] = Counter()
    factor, closest = scipy.sparse.linalg.splu, TriangleSearch.closest
    looking = [False]

    def counted_factor(matrix: Any, *more: Any, **options: Any) -> CountedFactor:
        found["factorisations"] += 1
        found["unknowns"] += matrix.shape[0]
        found[f"factorisations of {matrix.shape[0]}"] += 1
        return CountedFactor(factor(matrix, *more, **options), matrix.shape[0], found)

    def counted_closest(self: TriangleSearch, points: Any, *more: Any, **options: Any) -> Any:
        if looking[0]:
            return closest(self, points, *more, **options)
        found["closest points"] += len(points)
        looking[0] = True
        try:
            return closest(self, points, *more, **options)
        finally:
            looking[0] = False

    among_all = Balls._search

    def counted_among_all(self: Balls, trial: Any, rows: Any, *more: Any) -> Any:
        found["closest points among all triangles"] += len(rows)
        return among_all(self, trial, rows, *more)

    monkeypatch.setattr(scipy.sparse.linalg, "splu", counted_factor)
    monkeypatch.setattr(Balls, "_search", counted_among_all)
    monkeypatch.setattr(TriangleSearch, "closest", counted_closest)
    return found


def cloned(source: AnimatableFace, backend: str, faps: Collection[int] | None = None) -> AnimatableFace:
    scene = read_scene(sample("faces/tri_head.obj"))
    points = read_landmarks(sample("faces/tri_head.fps.json"), scene)
    return clone(source, scene, points, backend=backend, faps=faps)


def test_a_whole_clone(counts: Counter[str], source: AnimatableFace, tmp_path: Path) -> None:
    face = cloned(source, "fit")
    # Twenty steps of the fit, and lids: two rims each of both eyes on both faces, and what holds them.
    assert counts["factorisations"] <= 30
    assert counts["unknowns"] <= 70_000
    assert counts["right-hand sides"] <= 4_600
    assert 0 < counts["closest points"] <= 71_000
    # Steps of a fit ask again near the last places.
    assert 0 < counts["closest points among all triangles"] <= 24_000
    path = tmp_path / "face.wrl"
    write(face, path)
    assert path.stat().st_size <= 2_600_000


def test_one_factor_solves_all_motions(counts: Counter[str], source: AnimatableFace, mine: PreparedFace) -> None:
    chosen = frozenset({3, 4, 51})
    cloned(source, "dt", chosen)
    # The fit's last two steps are as large; each solves for x, y and z.
    whole = mine.skin.place_sums.shape[0]
    assert counts[f"factorisations of {whole}"] == 3
    motions = len(source_motions(source, chosen))
    assert motions > 10
    assert counts[f"right-hand sides of {whole}"] <= 3 * motions + 2 * 3
