"""What the playing forms of VRML97 and X3D need of a file's syntax tree: ways through it, and lights."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.scene import Frame
from formats.vrml97.tree import Booleans, Statement, Use, VrmlNode, node, number, walk

_LIGHTS = frozenset({"DirectionalLight", "PointLight", "SpotLight"})

_OWN_LIGHTS = (((0.4, -0.5, -0.8), 0.85), ((-0.8, -0.1, -0.6), 0.4))
"""Directions (inside axes) and intensities: one from above on the viewer's left, a weaker one from the right."""


def fields_of(owner: VrmlNode, *names: str) -> list[VrmlNode]:
    """The nodes that a chain of fields leads to."""
    found = [owner]
    for name in names:
        found = [n for o in found for n in o.nodes(name) if isinstance(n, VrmlNode)]
    return found


def resolved(owner: VrmlNode, name: str, known: Mapping[str, VrmlNode]) -> VrmlNode:
    """The node in a field, whether it stands there or is used."""
    item = owner.nodes(name)[0]
    return known[item.name] if isinstance(item, Use) else item


def target_of(entry: VrmlNode) -> str:
    """DEF name of the node that a FaceDefMesh or FaceDefTransform is about."""
    (used,) = entry.nodes("faceSceneGraphNode")
    assert isinstance(used, Use)
    return used.name


def lit(statements: tuple[Statement, ...], frame: Frame) -> tuple[Statement, ...]:
    """The file with two lights of its own and none at the viewer's head; as it is where it has a light."""
    if any(isinstance(n, VrmlNode) and n.type in _LIGHTS for n in walk(statements)):
        return statements
    lights = tuple(
        node(
            "DirectionalLight",
            direction=number(*frame.to_file(np.array(to))),
            intensity=number(power),
            ambientIntensity=number(0.4),
        )
        for to, power in _OWN_LIGHTS
    )
    out: list[Statement] = []
    for item in statements:
        if isinstance(item, VrmlNode) and item.type == "NavigationInfo":
            item = item.with_field("headlight", Booleans((False,)))
        out.append(item)
    return (*lights, *out)
