"""Names of nodes in a scene: never empty, never twice."""

from __future__ import annotations

from collections.abc import Iterable


def unique_names(names: Iterable[str], empty: str = "face") -> list[str]:
    """Return the names in order; an empty one becomes `empty`, a repeated one gets a number behind.

    >>> unique_names(["eye", "eye", ""])
    ['eye', 'eye_2', 'face']
    """
    taken: set[str] = set()
    out: list[str] = []
    for name in names:
        base = name or empty
        label, number = base, 1
        while label in taken:
            number += 1
            label = f"{base}_{number}"
        taken.add(label)
        out.append(label)
    return out
