"""The shapes of one face by what they mean: units, and FAPs, visemes and expressions given directly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from authoring.construction import Offsets
from authoring.names import GAZES, SIDES, Meaning, meaning
from authoring.riders import skin_offsets
from cloning.prepare import PreparedFace
from fat.rig import EYE_FAPS, HEAD_FAPS
from fba.arrays import Floats
from fba.errors import MeshError
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from fba.findings import Finding
from fba.scene import Role
from fba.shapes import ShapeSet

HALF_WIDTH = 0.12
"""Width of the blend between the halves of a shape that moves both sides, in eye separations."""

MOVES = 0.02
"""Skin that moves by more than this, in eye separations, takes along what lies on it, unless that is known to rest."""

PUPIL = "pupilDilate"
"""The unit that lives on the eyeballs."""

ROTATIONS = (*(n for rows in EYE_FAPS.values() for _, n in rows), *(n for _, n in HEAD_FAPS))
"""FAPs of eyeballs and head: transforms, not shapes."""

RESTING = (Role.EYE_LEFT, Role.EYE_RIGHT, Role.UPPER_TEETH)
"""Parts that units leave where they are: eyeballs turn by FAPs 23 to 26, the upper teeth belong to the skull."""


@dataclass(frozen=True, eq=False)
class Given:
    """A shape that is a FAP, viseme or expression by itself.

    value : FAP value that it shows; None where nothing says it.
    """

    shape: str
    value: int | None
    offsets: Offsets


@dataclass(frozen=True, eq=False)
class Units:
    """Units of a face, halves and wholes made from each other.

    Attributes
    ----------
    offsets : unit -> offsets at its full value.
    shapes : unit -> name of the shape that it comes from.
    """

    face: PreparedFace
    offsets: Mapping[str, Offsets]
    shapes: Mapping[str, str]

    def get(self, name: str) -> Offsets | None:
        """One unit; None if the face's shapes do not have it."""
        if name in self.offsets:
            return self.offsets[name]
        for side in SIDES:
            whole = name.removesuffix(side)
            if whole != name and whole in self.offsets:
                return {s: self.halves[s][SIDES.index(side)] * part for s, part in self.offsets[whole].items()}
        both = [self.offsets.get(name + side) for side in SIDES]
        if both[0] is None or both[1] is None:
            return None
        return added(both[0], both[1])

    def sources(self, name: str) -> tuple[str, ...]:
        """The shapes behind a unit that `get` returns."""
        names = (name, *(name.removesuffix(s) for s in SIDES), *(name + s for s in SIDES))
        found = dict.fromkeys(self.shapes[n] for n in names if n in self.shapes)
        return tuple(found) if name not in self.shapes else (self.shapes[name],)

    @cached_property
    def halves(self) -> dict[str, tuple[Floats, Floats]]:
        """Shape -> (n, 1) share of the left and of the right half of the face."""
        middle = 0.5 * float(self.face.place("3.5")[0] + self.face.place("3.6")[0])
        found = {}
        for shape in self.face.scene.shapes:
            x = self.face.scene.world_vertices(shape.name)[:, :1] - middle
            left = 0.5 * (1.0 + np.tanh(x / (HALF_WIDTH * self.face.fapu.es0)))
            found[shape.name] = (left, 1.0 - left)
        return found


@dataclass(frozen=True, eq=False)
class FaceShapes:
    """All shapes of a face, sorted.

    Attributes
    ----------
    given : (fap_id, select) -> shapes that are this FAP, viseme or expression.
    resting : parts that lie on moving skin and yet never move in any shape: spectacles, hair, clothes.
    """

    units: Units
    given: Mapping[tuple[int, int], tuple[Given, ...]]
    unknown: tuple[str, ...]
    ignored: Mapping[str, str]
    resting: frozenset[str]
    findings: tuple[Finding, ...]

    def without_resting(self, offsets: Mapping[str, Floats]) -> Offsets:
        """The offsets without those of parts that rest."""
        return {name: part for name, part in offsets.items() if name not in self.resting}


def sort_shapes(
    face: PreparedFace,
    shapes: ShapeSet | Mapping[str, Mapping[str, Floats]],
    names: Mapping[str, Meaning] | None = None,
) -> FaceShapes:
    """Find out what every shape means.

    Parameters
    ----------
    shapes : morph targets in the file's own axes, units and vertex order; or name -> offsets by shape.
    names : meanings that go before those of `authoring.names`.

    Raises
    ------
    MeshError
        If the shapes do not fit the face.
    """
    units: dict[str, Offsets] = {}
    origin: dict[str, str] = {}
    given: dict[tuple[int, int], list[Given]] = {}
    unknown: list[str] = []
    ignored: dict[str, str] = {}
    findings: list[Finding] = []
    taken: dict[tuple[str, int, str, int | None], str] = {}
    offsets = _by_shape(face, shapes)
    names = names or {}
    for name in names:
        if name not in offsets:
            text = f"the map speaks of a shape '{name}', which is not among the {len(offsets)} shapes"
            findings.append(Finding("warning", "no-such-shape", text, name))
    for name, moved in offsets.items():
        said = names.get(name) or meaning(name)
        if said is None:
            unknown.append(name)
            continue
        if said.key in taken and said.kind != "ignored":
            ignored[name] = f"means the same as '{taken[said.key]}'"
            continue
        taken[said.key] = name
        if said.kind == "ignored":
            ignored[name] = said.unit
        elif said.kind == "fap" and said.number in ROTATIONS:
            ignored[name] = "eyes and head turn exactly by transforms"
        elif said.kind == "unit":
            units[said.unit] = moved if said.unit.startswith(PUPIL) else resting(face, moved)
            origin[said.unit] = name
            if said.unit.startswith(GAZES):
                ignored[name] = "eyes turn exactly by FAPs 23 to 26"
        else:
            fap_id, select = _key(said)
            given.setdefault((fap_id, select), []).append(Given(name, said.value, moved))
    for name in unknown:
        text = f"the shape '{name}' has a name that says nothing; a map (--map) can say what it is"
        findings.append(Finding("warning", "unknown-shape", text, name))
    return FaceShapes(
        Units(face, units, origin),
        {key: tuple(rows) for key, rows in given.items()},
        tuple(unknown),
        ignored,
        _resting_parts(face, list(offsets.values())),
        tuple(findings),
    )


def _resting_parts(face: PreparedFace, shapes: Sequence[Offsets]) -> frozenset[str]:
    """Parts besides the skin that rest in every shape, though the skin below them moves in some."""
    moving = {name for offsets in shapes for name in offsets}
    others = {s.name for s in face.scene.with_role(Role.OTHER) if s.mesh.vertex_count} - moving
    found: set[str] = set()
    for offsets in shapes:
        if others <= found:
            break
        riding = skin_offsets(face, face.skin.join(offsets) / face.fapu.es0)
        found.update(n for n in others & riding.keys() if np.abs(riding[n]).max() > MOVES * face.fapu.es0)
    return frozenset(found)


def resting(face: PreparedFace, offsets: Mapping[str, Floats]) -> Offsets:
    """The offsets without those of parts that units leave where they are."""
    still = {shape.name for role in RESTING for shape in face.scene.with_role(role)}
    return {name: part for name, part in offsets.items() if name not in still}


def added(a: Mapping[str, Floats], b: Mapping[str, Floats], share: float = 1.0) -> Offsets:
    """a + share x b, shape by shape."""
    out = dict(a)
    for name, part in b.items():
        out[name] = out[name] + share * part if name in out else share * part
    return out


def _key(said: Meaning) -> tuple[int, int]:
    if said.kind == "fap":
        return said.number, 1
    return (VISEME_FAP if said.kind == "viseme" else EXPRESSION_FAP), said.number


def _by_shape(face: PreparedFace, shapes: ShapeSet | Mapping[str, Mapping[str, Floats]]) -> dict[str, Offsets]:
    """Offsets in world coordinates, inside axes, shape by shape; shapes that rest are absent."""
    if isinstance(shapes, ShapeSet):
        scene = face.scene
        if len(shapes.neutral) != scene.vertex_count:
            raise MeshError(
                f"the shapes have {len(shapes.neutral)} vertices, but the neutral face '{scene.name}' has "
                f"{scene.vertex_count}; they must be of the same file"
            )
        rows = ((n, scene.scatter(scene.frame.from_file(d))) for n, d in zip(shapes.names, shapes.deltas, strict=True))
        return {name: {s: part for s, part in parts.items() if part.any()} for name, parts in rows}
    counts = {s.name: s.mesh.vertex_count for s in face.scene.shapes}
    for name, parts in shapes.items():
        for shape, part in parts.items():
            if shape not in counts or part.shape != (counts[shape], 3):
                raise MeshError(f"the shape '{name}' has offsets for '{shape}' that do not fit the neutral face")
    return {name: {s: np.asarray(p) for s, p in parts.items() if np.any(p)} for name, parts in shapes.items()}
