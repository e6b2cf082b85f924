"""Which reading of open_jaw a face shall have, and what its file says about it."""

from __future__ import annotations

from fat.face import AnimatableFace
from fat.open_jaw import MEANINGS, NOTE, Mode, closed_mouth, open_jaw_mode
from fba.errors import UnsupportedFeatureError
from fba.findings import Finding


def with_open_jaw(face: AnimatableFace, mode: Mode | None) -> tuple[AnimatableFace, list[Finding]]:
    """Return the face with an open_jaw of this kind, None for the one that it has, and what is to be said about it.

    Raises
    ------
    UnsupportedFeatureError
        If a strict open_jaw is asked to become practical: the way of the lips is not in it.
    FaceDefTablesError, LandmarkError
        If open_jaw cannot be made strict.
    """
    if mode is None:
        return face, []
    if mode == "strict":
        from authoring.open_jaw import strict

        made = strict(face)
        return made, closed_mouth(made)
    if open_jaw_mode(face) == "strict":
        raise UnsupportedFeatureError(
            "this open_jaw is strict, and how far the lips would go along is not in it; start from a practical source"
        )
    return face, []


def note_findings(face: AnimatableFace) -> list[Finding]:
    """A warning where the file's own word about open_jaw is not what its tables do."""
    mode, said = open_jaw_mode(face), face.notes.get(NOTE)
    if mode is None or said not in MEANINGS or said == mode:
        return []
    message = f"the file calls its open_jaw {said}, but by its tables it is {mode}: {MEANINGS[mode]}"
    return [Finding("warning", "open-jaw", message, NOTE)]
