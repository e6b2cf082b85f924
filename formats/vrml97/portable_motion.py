"""FAP streams and rigid motion as interpolators: nodes that every VRML97 and X3D browser runs without a Script.

A TimeSensor drives one ScalarInterpolator a table, which gives the table's value. Interpolators may have any keys,
not only 0 to 1: so the value of a table drives an OrientationInterpolator (for eyes and head) whose keys are FAP
values.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fat.evaluate import Player
from fat.face import AnimatableFace
from fat.tables import FaceDefTable, FaceDefTransform, TransformField
from fba.arrays import Floats
from fba.errors import FaceDefTablesError, UnsupportedFeatureError
from fba.faps import EXPRESSION_FAP
from fba.fapu import ANGLE_UNIT
from fba.scene import Frame, Transform
from fba.stream import FapStream
from formats.vrml97.axes import turn_axis, turn_point, turn_sizes
from formats.vrml97.names import Names, escape
from formats.vrml97.tree import Booleans, Route, VrmlNode, node, number, numbers

CLOCK = "fba_clock"
"""DEF name of the TimeSensor."""

_VALUE_DIGITS = 3
"""Decimals of table values: a thousandth of a FAP unit."""

_KEY_DIGITS = 9
"""Decimals of times as shares of the cycle: a microsecond in twenty minutes."""

_FARTHEST = 1e6
"""Table value up to which translations and scales go on: far beyond every FAP's range."""

_NEARLY = 0.5
"""Table values nearer to 0 than this leave a field as the file has it, where the table's own neutral is another."""

_FIELDS = {
    TransformField.ROTATION: ("OrientationInterpolator", "rotation"),
    TransformField.TRANSLATION: ("PositionInterpolator", "translation"),
    TransformField.SCALE: ("PositionInterpolator", "scale"),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """Interpolator nodes, and the ROUTEs from and between them."""

    nodes: tuple[VrmlNode, ...] = ()
    routes: tuple[Route, ...] = ()

    @classmethod
    def joined(cls, parts: Iterable[Motion]) -> Motion:
        """All of them as one."""
        found = tuple(parts)
        return cls(tuple(n for p in found for n in p.nodes), tuple(r for p in found for r in p.routes))


def table_labels(face: AnimatableFace, taken: Iterable[str]) -> list[str]:
    """DEF names of the tables, none of them `taken`: ``fap_03_open_jaw``, ``viseme_PP``."""
    names = Names(taken)
    return [names.give(escape(_label(table))) for table in face.tables]


def _label(table: FaceDefTable) -> str:
    return table.name if table.fap_id <= EXPRESSION_FAP else f"fap_{table.fap_id:02d}_{table.name}"


def stream_values(face: AnimatableFace, stream: FapStream) -> tuple[Floats, Floats]:
    """Times (f,) in seconds from the first frame, and table values (f, tables) with fighting FAPs combined."""
    times = (stream.frame_numbers - stream.frame_numbers[:1]) / stream.frame_rate
    return times, np.round(Player(face).table_values(stream), _VALUE_DIGITS) + 0.0


def clock(times: Floats, rate: float) -> VrmlNode:
    """A TimeSensor that runs through the frames again and again, the last one to the first within no time."""
    length = float(times[-1]) if len(times) > 1 else 1.0 / rate
    return node("TimeSensor", CLOCK, cycleInterval=number(length), loop=Booleans((True,)))


def value_motion(label: str, times: Floats, values: Floats) -> Motion:
    """What gives a table its values (f,) over time: an interpolator ``LABEL_values``, whose output goes nowhere yet."""
    key = np.round(times / (times[-1] or 1.0), _KEY_DIGITS)
    same = np.concatenate([[False], np.diff(values) == 0.0, [False]])
    kept = ~(same[:-1] & same[1:])
    name = f"{label}_values"
    made = node("ScalarInterpolator", name, key=numbers(key[kept]), keyValue=numbers(values[kept]))
    return Motion((made,), (Route(CLOCK, "fraction_changed", name, "set_fraction"),))


def check_one_driver(face: AnimatableFace) -> None:
    """Refuse two tables that drive one field, since interpolators cannot tell which of them holds.

    Raises
    ------
    UnsupportedFeatureError, FaceDefTablesError
        If there are such tables; if a table speaks of a transform that is not in the scene.
    """
    driven: dict[tuple[str, TransformField], str] = {}
    names = {t.name for t in face.scene.transforms}
    for table in face.tables:
        for entry in table.transforms:
            if entry.transform not in names:
                raise FaceDefTablesError(f"{table.name}: there is no Transform '{entry.transform}' in the scene")
            key = (entry.transform, entry.field)
            if driven.setdefault(key, table.name) != table.name:
                raise UnsupportedFeatureError(
                    f"{driven[key]} and {table.name} both drive the {_FIELDS[entry.field][1]} of "
                    f"'{entry.transform}', which interpolators cannot show; give each a Transform of its own"
                )


def transform_motion(face: AnimatableFace, entry: FaceDefTransform, name: str, target: str) -> Motion:
    """What one FaceDefTransform does: an interpolator with FAP values as keys, and its ROUTE to the node `target`."""
    part = next(t for t in face.scene.transforms if t.name == entry.transform)
    kind, field = _FIELDS[entry.field]
    key, rows = _field_keys(entry, part, face.scene.frame)
    made = node(kind, name, key=numbers(key), keyValue=numbers(rows))
    return Motion((made,), (Route(name, "value_changed", target, f"set_{field}"),))


def _field_keys(entry: FaceDefTransform, part: Transform, frame: Frame) -> tuple[Floats, Floats]:
    """FAP values (k,) and the field's values (k, 3 or 4) there, in the file's axes."""
    turn = frame.to_file
    if entry.field is TransformField.ROTATION:
        axis, theta = turn_axis(entry.rotation_def[:3], turn), entry.rotation_def[3] * ANGLE_UNIT
        # A browser takes the shorter way between two keys, so that there is one every quarter turn.
        step = 0.5 * np.pi / abs(theta) if theta and any(axis) else _FARTHEST
        key = step * np.arange(-4.0, 5.0)
        rest: tuple[float, ...] = (*turn_axis(part.rotation[:3], turn), part.rotation[3])
        neutral = part.rotation[3] == 0.0
        unit = axis if any(axis) else (0.0, 0.0, 1.0)

        def at(value: float) -> tuple[float, ...]:
            return (*unit, theta * value if any(axis) else 0.0)
    else:
        key = np.array([-_FARTHEST, 0.0, _FARTHEST])
        moves = entry.field is TransformField.TRANSLATION
        slope = turn_point(entry.translation_def, turn) if moves else turn_sizes(entry.scale_def, turn)
        rest = turn_point(part.translation, turn) if moves else turn_sizes(part.scale, turn)
        neutral = moves and not any(part.translation)

        def at(value: float) -> tuple[float, ...]:
            return tuple(value * s for s in slope)

    if neutral:
        return key, np.array([at(v) for v in key])
    middle = len(key) // 2
    key = np.concatenate([key[:middle], [-_NEARLY, 0.0, _NEARLY], key[middle + 1 :]])
    return key, np.array([rest if v == 0.0 else at(v) for v in key])
