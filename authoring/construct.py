"""All constructions: which FAP is made how, when no shape of the face shows it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from authoring import brows, cheeks, chin, ears, eyes, jaw, lids, lips, nose, tongue
from authoring.construction import Construction
from cloning.prepare import PreparedFace
from fat.motion import FaceMotion
from fat.tables import table_name
from fba.errors import FbaError
from fba.faps import fap
from fba.findings import Finding

_MODULES = (lips, brows, cheeks, chin, nose, ears, jaw, lids, tongue, eyes)


@cache
def constructions() -> Mapping[int, Construction]:
    """FAP -> its construction, in ascending order."""
    found = {number: made for module in _MODULES for number, made in module.CONSTRUCTIONS.items()}
    return dict(sorted(found.items()))


def construct(face: PreparedFace, fap_id: int) -> tuple[list[FaceMotion], list[Finding]]:
    """Make one FAP from the face's feature points alone.

    Returns
    -------
    motions : at every border, rising; empty where it cannot be made.
    findings : why not.
    """
    made = constructions().get(fap_id)
    if made is None:
        return [], [_missing(fap_id, "there is no construction of this FAP")]
    absent = [key for key in made.needs if key not in face.points]
    if absent:
        return [], [_missing(fap_id, f"it needs the feature points {', '.join(absent)}")]
    try:
        steps = [(border, made.make(face, border)) for border in made.borders]
    except FbaError as error:
        return [], [_missing(fap_id, str(error))]
    motions = [FaceMotion(table_name(fap_id), fap_id, 1, border, offsets) for border, offsets in steps if offsets]
    if not motions:
        return [], [_missing(fap_id, "this face has nothing that it could move")]
    return motions, []


def _missing(fap_id: int, why: str) -> Finding:
    return Finding("warning", "not-constructed", f"{fap(fap_id).name} is not constructed: {why}", f"FAP {fap_id}")
