"""Names of prims: valid identifiers, unique below one parent."""

from __future__ import annotations

from pxr import Sdf, Tf, Usd

from fba.scene import FaceScene, Transform
from formats.usd.properties import get, put_string

RESERVED = ("Animation", "FeaturePoints", "Materials", "Skeleton", "Tables")
"""Prims of the writer itself; a node of that name gets a number behind."""

CHILDREN = "children"
"""Own relationship of the root and of transforms: the prims of their child nodes, in order."""


class Namer:
    """Hands out identifiers, each once."""

    def __init__(self, taken: tuple[str, ...] = ()) -> None:
        self._taken = set(taken)

    def name(self, wanted: str) -> str:
        """A valid identifier like `wanted` that was not handed out before."""
        base: str = Tf.MakeValidIdentifier(wanted)
        label, number = base, 1
        while label in self._taken:
            number += 1
            label = f"{base}_{number}"
        self._taken.add(label)
        return label


def node_paths(scene: FaceScene, root: Sdf.Path) -> dict[str, Sdf.Path]:
    """Path of the prim of every node of a scene, parents first; shapes stand directly below the root."""
    namers: dict[Sdf.Path, Namer] = {}
    paths: dict[str, Sdf.Path] = {}
    for node, parents in scene.walk():
        parent = paths[parents[-1].name] if parents and isinstance(node, Transform) else root
        namer = namers.setdefault(parent, Namer(RESERVED))
        paths[node.name] = parent.AppendChild(namer.name(node.name))
    return paths


def put_name(prim: Usd.Prim, name: str) -> None:
    """Keep a name that is no identifier, or not unique, with its prim."""
    if prim.GetName() != name:
        put_string(prim, "name", name)


def name_of(prim: Usd.Prim) -> str:
    """The name that `put_name` kept, else the prim's own."""
    kept = get(prim, "name")
    return str(prim.GetName()) if kept is None else str(kept)
