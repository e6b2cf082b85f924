"""Names of nodes in a scene: never empty, never twice."""

from __future__ import annotations

from collections.abc import Iterable


class UniqueNames:
    """Hands out names, each once: a repeated one gets a number behind.

    >>> names = UniqueNames()
    >>> [names.take("eye"), names.take("eye", ".png"), names.take("eye")]
    ['eye', 'eye.png', 'eye_2']
    """

    def __init__(self) -> None:
        self._taken: set[str] = set()
        self._numbers: dict[tuple[str, str], int] = {}
        """Last number behind a name; trying all of them again takes long where very many are alike."""

    def take(self, name: str, ending: str = "") -> str:
        """A name that was not there before; its number stands before the ending."""
        label, number = name + ending, self._numbers.get((name, ending), 1)
        while label in self._taken:
            number += 1
            label = f"{name}_{number}{ending}"
        self._taken.add(label)
        self._numbers[name, ending] = number
        return label


def unique_names(names: Iterable[str], empty: str = "face") -> list[str]:
    """Return the names in order; an empty one becomes `empty`, a repeated one gets a number behind.

    >>> unique_names(["eye", "eye", ""])
    ['eye', 'eye_2', 'face']
    """
    unique = UniqueNames()
    return [unique.take(name or empty) for name in names]
