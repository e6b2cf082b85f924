"""What a comparison of clones holds: cells, their means, and the grids they are drawn in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from PIL import Image

from fba.findings import Finding
from studio.sheet import Sheet


@dataclass(frozen=True, slots=True)
class Way:
    """A backend, as repaired or as its paper has it."""

    backend: str
    as_published: bool = False

    def __str__(self) -> str:
        return f"{self.backend} published" if self.as_published else self.backend


@dataclass(frozen=True, slots=True)
class Cell:
    """One motion of one clone beside the source's.

    Attributes
    ----------
    generation : 1 for a clone of the source; 2 for one that went from the source to the target, back and there again.
    fp_error : difference of the FAP values that the feature points show, relative (0.01 = 1 %).
    fp_largest : the largest of these differences, in FAP units.
    flips, source_flips : percent of the moving skin triangles that turn over.
    stretch, source_stretch : 99th percentile of |log(edge length after / before)|.
    drift : relative L2 distance of the skin's motion from the first generation's; None for that one.
    """

    source: str
    target: str
    backend: str
    as_published: bool
    generation: int
    motion: str
    fp_error: float
    fp_largest: float
    flips: float
    source_flips: float
    stretch: float
    source_stretch: float
    drift: float | None


@dataclass(frozen=True, eq=False)
class Comparison:
    """What was measured, the grids, and what went wrong.

    Attributes
    ----------
    cells : every motion of every clone.
    grids : one for each motion: the targets at rest, below them a row for each source, backend and generation.
    findings : errors for pairs that could not be cloned, warnings for motions that a source lacks.
    """

    cells: tuple[Cell, ...]
    grids: tuple[Sheet, ...]
    findings: tuple[Finding, ...]

    def image(self) -> Image.Image:
        """All grids, one below the other."""
        whole = Sheet(", ".join(grid.title for grid in self.grids))
        for number, grid in enumerate(self.grids):
            for row in grid.rows[1 if number else 0 :]:
                label = f"{grid.title}: {row.label}" if len(self.grids) > 1 and row is not grid.rows[0] else row.label
                whole.rows.append(replace(row, label=label))
        return whole.image()

    def to_dict(self) -> dict[str, object]:
        """Plain data for JSON: all cells, and the mean over sources, targets and motions for each way."""
        return {"cells": [asdict(c) for c in self.cells], "means": [asdict(m) for m in self.means()]}

    def means(self) -> list[Mean]:
        """One line for each backend, mode and generation, in the order of the cells."""
        groups: dict[tuple[str, bool, int], list[Cell]] = {}
        for cell in self.cells:
            groups.setdefault((cell.backend, cell.as_published, cell.generation), []).append(cell)
        return [Mean.of(key, group) for key, group in groups.items()]


@dataclass(frozen=True, slots=True)
class Mean:
    """Cells of one backend, mode and generation taken together; fields as in `Cell`."""

    backend: str
    as_published: bool
    generation: int
    cells: int
    fp_error: float
    flips: float
    source_flips: float
    stretch: float
    source_stretch: float
    drift: float | None

    @classmethod
    def of(cls, key: tuple[str, bool, int], cells: Sequence[Cell]) -> Mean:
        """The mean of some cells; of what can be infinite, over the finite ones."""

        def mean(name: str) -> float:
            values = np.array([getattr(c, name) for c in cells], dtype=np.float64)
            return float(values[np.isfinite(values)].mean()) if np.isfinite(values).any() else float("nan")

        drift = None if any(c.drift is None for c in cells) else mean("drift")
        return cls(
            *key,
            len(cells),
            mean("fp_error"),
            mean("flips"),
            mean("source_flips"),
            mean("stretch"),
            mean("source_stretch"),
            drift,
        )
