"""A face beside the truth: the same mesh, moved as it should be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fat.face import AnimatableFace
from fat.quality import truth_error
from fba.amplitudes import amplitudes
from fba.errors import MeshError
from fba.faps import EXPRESSION_FAP
from fba.high_level import BLEND_MAX
from fba.scene import Role
from studio.checked_skin import CheckedSkin
from studio.posing import Poses
from studio.verdicts import Place, Reading, Verdict, judge

SAME = 1e-3
"""Eye separations by which the vertices of the same mesh may differ: files round."""


def require_same_mesh(face: AnimatableFace, truth: AnimatableFace) -> None:
    """Raise unless the truth has the face's own skin, vertex by vertex.

    Raises
    ------
    MeshError
        If shapes, numbers of vertices or neutral places differ.
    """
    advice = "the truth needs the checked face's own mesh, vertex by vertex"
    known = {s.name: s for s in truth.scene.with_role(Role.SKIN)}
    for shape in face.scene.with_role(Role.SKIN):
        other = known.get(shape.name)
        if other is None:
            raise MeshError(f"the truth has no skin '{shape.name}', only {sorted(known)}: {advice}")
        mine, theirs = shape.mesh.vertex_count, other.mesh.vertex_count
        if mine != theirs:
            raise MeshError(f"skin '{shape.name}' has {mine} vertices, the truth's has {theirs}: {advice}")
        places = face.scene.world_vertices(shape.name), truth.scene.world_vertices(shape.name)
        off = float(np.abs(places[0] - places[1]).max(initial=0.0)) / face.fapu.es0
        if off > SAME:
            raise MeshError(
                f"neutral vertices of skin '{shape.name}' differ from the truth's by up to {off:.3g} eye separations: "
                f"{advice}"
            )


def beside_truth(face: AnimatableFace, truth: AnimatableFace, skin: CheckedSkin) -> list[Verdict]:
    """Both measures of truth: the relative L2 distance from the true offsets of what is seen and what is hidden.

    Means over the motions of both faces that move such skin; the worst motion is told. Nothing without such motions.

    Parameters
    ----------
    truth : with the face's own mesh, see `require_same_mesh`.
    skin : the face's.
    """
    mine, theirs = Poses(face), Poses(truth)
    found: dict[str, list[tuple[float, str, tuple[int, int, int]]]] = {"truth": [], "truth-hidden": []}
    for name, key in _common(face, truth):
        here, real = (skin.surface.join(p.pose(key).mesh_offsets()) for p in (mine, theirs))
        for code, where in (("truth", skin.seen), ("truth-hidden", ~skin.seen)):
            if np.any(real[where]):
                found[code].append((truth_error(here, real, where), name, key))
    verdicts = []
    for code, errors in found.items():
        if errors:
            mean = float(np.mean([error for error, *_ in errors]))
            _, name, key = max(errors)
            verdicts.append(judge(code, [Reading(mean, None, name, Place(key))]))
    return [v for v in verdicts if v is not None]


def _common(face: AnimatableFace, truth: AnimatableFace) -> Iterator[tuple[str, tuple[int, int, int]]]:
    """Name and key of every motion that both have, at its normal amplitude."""
    for table in face.tables:
        if truth.tables.get(table.fap_id, table.high_level_select) is None:
            continue
        high = table.fap_id <= EXPRESSION_FAP
        for value in (BLEND_MAX,) if high else amplitudes()[table.fap_id].values:
            name = table.name if high else f"{table.name} at {value:+d}"
            yield name, (table.fap_id, table.high_level_select, value)


__all__ = ["beside_truth", "require_same_mesh"]
