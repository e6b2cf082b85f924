"""A map in TOML that says what shapes of any name mean.

``[shapes."my smile"]`` with one of ``fap``, ``viseme``, ``expression``, ``unit`` (or ``arkit``), ``ignore = true``;
``value`` is the FAP value that the shape shows.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from authoring.names import Meaning, unit_name
from fba.errors import InputFileError
from fba.faps import EXPRESSION_FAP, FAP_COUNT, fap
from fba.high_level import EXPRESSIONS, VISEMES

MEANINGS = ("fap", "viseme", "expression", "unit", "arkit", "ignore")

LARGEST_VALUE = 10_000_000
"""Beyond any FAP value that MPEG-4 can carry."""


def parse_map(data: bytes, where: str) -> dict[str, Meaning]:
    """Read a map.

    Parameters
    ----------
    data : the TOML text, UTF-8.
    where : the file's name, for messages.

    Returns
    -------
    Shape name -> what it means.

    Raises
    ------
    InputFileError
        If it is no TOML, or an entry says something impossible; the message names line and shape.
    """
    try:
        text = data.decode("utf-8")
        document = tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputFileError(f"{where}: this is not UTF-8 text; a shape map is a TOML file") from None
    except tomllib.TOMLDecodeError as error:
        raise InputFileError(f"{where}: this is not TOML: {error}") from None
    more = sorted(set(document) - {"shapes"})
    shapes = document.get("shapes")
    if more or not isinstance(shapes, dict) or not shapes:
        found = f"'{more[0]}'" if more else "nothing"
        raise InputFileError(f'{where}: expected tables [shapes."NAME"], found {found}')
    return {name: _Entry(where, text, name).read(row) for name, row in shapes.items()}


class _Entry:
    """One table of the map; knows where it stands, for messages."""

    def __init__(self, where: str, text: str, name: str) -> None:
        lines = text.splitlines()
        header = re.compile(r"\[\s*shapes\s*\.")
        at = next((k for k, line in enumerate(lines, 1) if name in line and header.search(line)), None)
        at = at or next((k for k, line in enumerate(lines, 1) if name in line), None)
        self.place = f"{where}, line {at}, shape '{name}'" if at else f"{where}, shape '{name}'"

    def read(self, row: Any) -> Meaning:
        if not isinstance(row, dict):
            raise self.error('needs a table, e.g. { fap = "open_jaw", value = 500 }')
        more = sorted(set(row) - {*MEANINGS, "value"})
        if more:
            raise self.error(f"'{more[0]}' is not known; use one of {', '.join(MEANINGS)}, and value")
        said = [k for k in MEANINGS if k in row and row[k] is not False]
        if len(said) != 1:
            raise self.error(f"needs exactly one of {', '.join(MEANINGS)}, not {len(said)}")
        value = self._value(row, said[0])
        return self._meaning(said[0], row[said[0]], value)

    def _value(self, row: Mapping[str, Any], kind: str) -> int | None:
        value = row.get("value")
        if value is None:
            return None
        if kind != "fap":
            raise self.error(f"value belongs to a FAP, not to {kind}")
        if isinstance(value, bool) or not isinstance(value, int) or not 0 < abs(value) <= LARGEST_VALUE:
            raise self.error(f"value must be a whole number of FAP units other than 0, not {value!r}")
        return value

    def _meaning(self, kind: str, what: Any, value: int | None) -> Meaning:
        if kind == "ignore":
            if what is not True:
                raise self.error("ignore must be true")
            return Meaning("ignored", unit="the map says so")
        if kind in ("unit", "arkit"):
            unit = unit_name(what) if isinstance(what, str) else None
            if unit is None:
                raise self.error(f"there is no unit {what!r}; the names are listed in docs/authoring.md")
            return Meaning("unit", unit=unit)
        if kind == "fap":
            return Meaning("fap", self._fap(what), value=value)
        numbers = {row.name.casefold(): row.id for row in (VISEMES if kind == "viseme" else EXPRESSIONS)}
        number = numbers.get(what.casefold()) if isinstance(what, str) else what
        if isinstance(number, bool) or not isinstance(number, int) or number not in numbers.values():
            listed = ", ".join(row.name for row in (VISEMES if kind == "viseme" else EXPRESSIONS))
            raise self.error(f"there is no {kind} {what!r}; they are {listed}, or 1 to {len(numbers)}")
        return Meaning("viseme" if kind == "viseme" else "expression", number)

    def _fap(self, what: Any) -> int:
        if isinstance(what, str):
            try:
                number = fap(what).id
            except KeyError:
                number = 0
        else:
            number = what if isinstance(what, int) and not isinstance(what, bool) else 0
        if not EXPRESSION_FAP < number <= FAP_COUNT:
            raise self.error(f"there is no low-level FAP {what!r}; give 3 to {FAP_COUNT} or a name such as open_jaw")
        return number

    def error(self, text: str) -> InputFileError:
        return InputFileError(f"{self.place}: {text}")
