"""What a VRML or BT file held, kept beside the scene so that writing loses nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fba.findings import Finding
from fba.scene import Shape, Transform
from formats.vrml97.tree import BodyItem, Field, Nodes, Proto, Raw, Statement, Strings, Use, VrmlNode, definitions

METADATA_DEF = "fba_toolkit"
"""DEF name of the WorldInfo that carries what the standard's nodes cannot say."""

PLAYER_DEF = "fba_player"
"""DEF name of the Group with everything that plays a stream on a Face in browsers."""

MPEG4_NODES = frozenset(
    {"Face", "FDP", "FAP", "FIT", "FaceDefTables", "FaceDefMesh", "FaceDefTransform", "Viseme", "Expression"}
)


@dataclass(frozen=True, eq=False)
class VrmlDocument:
    """A parsed file.

    Attributes
    ----------
    statements : the file without its Face nodes (their scene graph stands in their place), without
        declarations of the MPEG-4 nodes and without this toolkit's WorldInfo and player; every DEF is unique.
    nodes : name of a shape or transform of the scene -> its node in `statements`.
    parts : the same names -> the shape or transform as it was read, file axes.
    face_fields : fields of the file's Face node that go out with the next Face: fit and ttsSource.
    findings : what the reader noticed.
    """

    statements: tuple[Statement, ...] = ()
    nodes: Mapping[str, VrmlNode] = field(default_factory=dict)
    parts: Mapping[str, Shape | Transform] = field(default_factory=dict)
    face_fields: tuple[Field, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return tuple(f"{f.where}: {f.message}" if f.where else f.message for f in self.findings)


@dataclass(frozen=True, eq=False)
class Split:
    """A file taken apart: `statements` as in VrmlDocument, the Face nodes, and the strings of the WorldInfo."""

    statements: tuple[Statement, ...]
    faces: tuple[VrmlNode, ...]
    metadata: tuple[str, ...]


def split(statements: tuple[Statement, ...]) -> Split:
    """Take Face nodes, declarations of MPEG-4 nodes, BT descriptors and the toolkit's WorldInfo out of a file."""
    top = _lifted(statements)
    without = _Splitter(None)
    elsewhere = definitions(without.outside(top))
    splitter = _Splitter(frozenset(elsewhere))
    return Split(tuple(splitter.outside(top)), tuple(splitter.faces), tuple(splitter.strings))


class _Splitter:
    """elsewhere : DEF names outside all Face nodes; None to leave out what Face nodes hold."""

    def __init__(self, elsewhere: frozenset[str] | None) -> None:
        self.elsewhere = elsewhere
        self.faces: list[VrmlNode] = []
        self.strings: list[str] = []

    def outside(self, items: Iterable[Any]) -> list[Any]:
        out: list[Any] = []
        for item in items:
            if isinstance(item, Raw) or (isinstance(item, Proto) and item.name in MPEG4_NODES):
                continue
            if not isinstance(item, VrmlNode):
                out.append(item)
            elif item.def_name == PLAYER_DEF and item.type == "Group":
                continue
            elif item.type == "Face":
                self.faces.append(item)
                out.extend(self.scene_graph(item))
            elif item.def_name == METADATA_DEF and item.type == "WorldInfo":
                info = item.get("info")
                self.strings.extend(info.values if isinstance(info, Strings) else ())
            else:
                out.append(self.without_faces(item))
        return out

    def without_faces(self, item: VrmlNode) -> VrmlNode:
        body: list[BodyItem] = []
        for part in item.body:
            if isinstance(part, Field) and isinstance(part.value, Nodes) and any(part.value.items):
                items = self.outside(part.value.items)
                part = Field(part.name, Nodes(tuple(items), part.value.many or len(items) != 1))
            body.append(part)
        return replace(item, body=tuple(body))

    def scene_graph(self, face: VrmlNode) -> list[Any]:
        """What a Face draws and nothing outside it holds already."""
        if self.elsewhere is None:
            return []
        fdp = next((n for n in face.nodes("fdp") if isinstance(n, VrmlNode)), None)
        graph = () if fdp is None else fdp.nodes("faceSceneGraph")
        own = [n for n in graph if not (isinstance(n, Use) and n.name in self.elsewhere)]
        return self.outside(own)


def _lifted(statements: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """BT has one top node: what its plain Group holds counts as the top of the file."""
    out: list[Statement] = []
    for item in statements:
        plain = isinstance(item, VrmlNode) and item.type == "Group" and item.def_name is None
        if plain and isinstance(item, VrmlNode) and any(_marks_top(n) for n in item.nodes("children")):
            out.extend(item.nodes("children"))
        else:
            out.append(item)
    return tuple(out)


def _marks_top(item: VrmlNode | Use) -> bool:
    return isinstance(item, VrmlNode) and (item.type == "Face" or item.def_name == METADATA_DEF)
