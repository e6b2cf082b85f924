"""Golden frames: where vertices are in every frame of a stream, to test one player against another.

The frames hold what the standard's tables say and nothing else: displacements of all tables summed, then the
Transforms (`Player` with no combination rules). Vertices are in the file's own order, axes and units.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import FaceDefTable
from fba.arrays import Floats, Ints, frozen
from fba.errors import FapStreamError
from fba.faps import EXPRESSION_FAP, LOW_LEVEL_FAPS, VISEME_FAP
from fba.faps import fap as fap_of
from fba.fapu import FAPU_DIVISOR
from fba.findings import Finding
from fba.high_level import BLEND_MAX, EXPRESSIONS, VISEMES
from fba.orientation import to_file_order
from fba.stream import FapStream

TOLERANCE = 1.0
"""FAP units of the face's smallest FAPU by which a player may miss a vertex: what a stream cannot even say."""

MIXED = ("two visemes", "two expressions", "several")
"""What motions are called that do not play alone."""

EVERY = 97
"""Of the vertices that are not among the most moved, each so many-th is kept."""


@dataclass(frozen=True, eq=False)
class Golden:
    """Vertices of a face in the frames of a stream.

    Attributes
    ----------
    ids : (m,) int32, which vertices of the file these are.
    neutral : (m, 3) at rest.
    frames : (f, m, 3).
    fps : frames a second.
    """

    ids: Ints
    neutral: Floats
    frames: Floats
    fps: float

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "ids", frozen(self.ids, np.int32, (-1,)))
        put(self, "neutral", frozen(self.neutral, np.float64, (-1, 3)))
        put(self, "frames", frozen(self.frames, np.float64, (-1, len(self.ids), 3)))
        if len(self.neutral) != len(self.ids):
            raise FapStreamError(f"{len(self.neutral)} neutral vertices, but {len(self.ids)} are named")


@dataclass(frozen=True, slots=True)
class Difference:
    """How the frames of one motion differ.

    Attributes
    ----------
    name : the FAP, viseme or expression that moves alone in these frames; "two visemes", "two expressions", or
        "several" where others play together.
    frames : how many frames.
    largest : the largest distance of a vertex from where it must be, in FAP units of the smallest FAPU.
    frame, vertex : where that is (index of the frame, number of the vertex in the file).
    factor : the motion times this comes nearest to the golden one; NaN where nothing moves.
    """

    name: str
    frames: int
    largest: float
    frame: int
    vertex: int
    factor: float

    @property
    def passed(self) -> bool:
        return self.largest <= TOLERANCE

    def finding(self) -> Finding:
        """What is wrong, in words."""
        text = f"vertex {self.vertex} is {self.largest:.4g} FAP units away from where it must be in frame {self.frame}"
        if np.isfinite(self.factor) and abs(self.factor - 1.0) > 1e-3:
            moved = "nothing moves" if abs(self.factor) < 1e-3 else f"the motion is {self.factor:.4g} times as large"
            text += f"; {moved}"
        return Finding("error", "golden-frames", text, self.name)


def record(face: AnimatableFace, stream: FapStream, ids: Ints | None = None, rules: Collection[str] = ()) -> Golden:
    """Play a stream.

    Parameters
    ----------
    ids : vertices to keep; None for all.
    rules : see `fat.evaluate.Player`; the default is the standard's plain sum.
    """
    kept = np.arange(face.scene.vertex_count, dtype=np.int32) if ids is None else ids
    frames = np.empty((len(stream), len(kept), 3))
    start = 0
    for batch in Player(face, rules=rules).world_frames(stream):
        frames[start : start + len(batch)] = to_file_order(face.scene, batch)[:, kept]
        start += len(batch)
    neutral = to_file_order(face.scene, face.scene.world_neutral())[kept]
    return Golden(kept, neutral, frames, stream.frame_rate)


def telling_vertices(face: AnimatableFace, stream: FapStream) -> Ints:
    """A small choice of vertices that shows whether a player is right: the most moved one of each frame, and some."""
    rest = to_file_order(face.scene, face.scene.world_neutral())
    chosen = set(range(0, len(rest), EVERY))
    for batch in Player(face, rules=()).world_frames(stream):
        moved = np.linalg.norm(to_file_order(face.scene, batch) - rest, axis=2)
        chosen |= set(moved.argmax(axis=1).tolist())
    return np.array(sorted(chosen), dtype=np.int32)


def compare(face: AnimatableFace, stream: FapStream, found: Golden, rules: Collection[str] = ()) -> list[Difference]:
    """Measure the frames of another player against those of this one, motion by motion.

    Parameters
    ----------
    found : what the other player makes of the face and the stream, for all vertices or some.
    rules : see `record`.

    Returns
    -------
    One entry for each FAP, viseme and expression that plays alone in some frame, one each for two visemes, for two
    expressions and for all other frames in which several play.

    Raises
    ------
    FapStreamError
        If the vertices, the neutral face or the number of frames differ, so that nothing can be compared.
    """
    if found.ids.size and int(found.ids.max()) >= face.scene.vertex_count:
        raise FapStreamError(
            f"the frames to test are of a vertex {int(found.ids.max())}, but '{face.scene.name}' has "
            f"{face.scene.vertex_count}"
        )
    if len(found.frames) != len(stream):
        raise FapStreamError(
            f"the stream '{stream.name}' has {len(stream)} frames, but {len(found.frames)} are to be tested"
        )
    golden = record(face, stream, found.ids, rules)
    unit = smallest_unit(face)
    _require_same_neutral(golden, found, unit)
    away = np.linalg.norm(found.frames - golden.frames, axis=2) / unit
    away[~np.isfinite(away)] = np.inf
    out = []
    for name, rows in motion_rows(face, stream).items():
        frame, vertex = np.unravel_index(int(np.argmax(away[rows])), (len(rows), away.shape[1]))
        wanted = (golden.frames[rows] - golden.neutral).ravel()
        got = (found.frames[rows] - found.neutral).ravel()
        size = float(wanted @ wanted)
        factor = float(got @ wanted) / size if size else float("nan")
        out.append(
            Difference(name, len(rows), float(away[rows].max()), rows[int(frame)], int(golden.ids[int(vertex)]), factor)
        )
    return out


def smallest_unit(face: AnimatableFace) -> float:
    """One FAP unit of the face's smallest FAPU, in units of the mesh."""
    return min(face.fapu.irisd0, face.fapu.es0, face.fapu.ens0, face.fapu.mns0, face.fapu.mw0) / FAPU_DIVISOR


def motion_rows(face: AnimatableFace, stream: FapStream) -> dict[str, list[int]]:
    """The frames of each motion, by its name (see `Difference`), in the order of the stream."""
    rows: dict[str, list[int]] = {}
    for k, name in enumerate(_names(face, stream)):
        rows.setdefault(name, []).append(k)
    return rows


def _require_same_neutral(golden: Golden, found: Golden, unit: float) -> None:
    away = np.linalg.norm(found.neutral - golden.neutral, axis=1) / unit
    worst = int(np.argmax(away)) if len(away) else 0
    if len(away) and not away[worst] <= TOLERANCE:
        raise FapStreamError(
            f"the neutral faces differ: vertex {int(golden.ids[worst])} is at {found.neutral[worst].tolist()} instead "
            f"of {golden.neutral[worst].tolist()}. Vertices must be in the file's own order, axes and units, in world "
            "coordinates"
        )


def _names(face: AnimatableFace, stream: FapStream) -> Iterator[str]:
    """What plays alone in each frame."""
    tables: dict[tuple[int, int], FaceDefTable] = {t.key: t for t in face.tables}
    low = np.array(LOW_LEVEL_FAPS)
    for k in range(len(stream)):
        faps = [fap_of(int(n)).name for n in low[(stream.values[k] * stream.mask[k])[low - 1] != 0]]
        visemes, expressions = [], []
        if stream.mask[k, VISEME_FAP - 1]:
            first, second, blend, _ = stream.visemes[k].tolist()
            chosen = ((first, blend), (second, BLEND_MAX - blend))
            visemes = [VISEMES[n - 1].name for n, share in chosen if share and (VISEME_FAP, n) in tables]
        if stream.mask[k, EXPRESSION_FAP - 1]:
            first, one, second, two, *_ = stream.expressions[k].tolist()
            chosen = ((first, one), (second, two))
            expressions = [EXPRESSIONS[n - 1].name for n, share in chosen if share and (EXPRESSION_FAP, n) in tables]
        playing = faps + visemes + expressions
        if len(playing) == 1 or not playing:
            yield playing[0] if playing else "neutral"
        else:
            yield MIXED[0] if playing == visemes else MIXED[1] if playing == expressions else MIXED[2]
