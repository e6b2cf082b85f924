"""Shapes of one face kit, cloned onto another kit, beside the shapes of the same names that its own artist made.

    python -m benchmarks.cross_kit [--json FILE] [--backends NAMES] [--sheet FILE] [--write]

MakeHuman -> Ready Player Me, ICT-FaceKit -> Ready Player Me, MakeHuman -> ICT-FaceKit, wherever their folders are
there. Two artists never mean the same by "mouthSmileLeft", so no number is an error: they say how much of what the
other artist made is met. --write puts the tables and the public part of the picture into docs/cross_kit.md.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.kits import SHARED, arkit_shapes, read_kit_points
from benchmarks.profiles import RPM_POINTS
from cloning import backends, clone_shapes
from cloning.prepare import PreparedFace, prepare
from cloning.visibility import visible
from fat.profiles import ARKIT
from fat.quality import fap_error, fap_values
from fba.arrays import Bools, Floats
from fba.faps import fap
from fba.feature_points import FeaturePoints
from fba.mesh import PolyMesh
from fba.orientation import to_file_order
from fba.scene import FaceScene, Role
from fba.shapes import ShapeSet
from formats import read_scene
from formats.landmarks import read_landmarks
from formats.shapes import read_shapes
from samples.build.arkit_anatomy import mirror_shape
from samples.build.arkit_docs import put_tables
from samples.build.makehuman import open_makehuman
from samples.build.phenotypes import known
from samples.build.source import source_head
from samples.build.surface import Places, nearest_facing
from studio.render.choice import make_renderer
from studio.render.figure import Figure, Style
from studio.render.shading import UInt8
from studio.sheet import Sheet

DOCS = Path(__file__).resolve().parents[1] / "docs"
MOVING = 0.1
"""Skin that moves by more than this part of the shape's largest move is its moving region."""
STILL = 1e-3
"""Eye separations below which nothing is seen moving: a shape that leaves the visible skin still is not compared."""
SHOWN = ("jawOpen", "eyeBlinkLeft", "mouthSmileLeft", "browInnerUp", "mouthFunnel")
PICTURE = (118, 140)
PAIRS = (("MakeHuman", "ICT"), ("MakeHuman", "RPM"), ("ICT", "RPM"))
PUBLIC = ("MakeHuman's own", "MakeHuman to ICT", "ICT's own")
"""Rows of faces that anybody may show (CC0, MIT)."""

ROWS = ("MakeHuman's own", "MakeHuman to ICT", "ICT's own", "MakeHuman to RPM", "ICT to RPM", "RPM's own")


@dataclass(frozen=True)
class Agreement:
    """How two motions of one skin agree; each the same whatever unit both are in.

    Attributes
    ----------
    cosine : of the two displacement fields over visible skin: 1 the same directions and proportions everywhere, 0
        nothing in common. sqrt(1 - cosine^2) is left over of the other motion at the best scale.
    scale : the one factor that brings the first motion nearest to the second.
    overlap : common part of the two moving regions, as a share of what moves in either.
    points : difference of the feature points' FAP values, sum of differences / sum of values; NaN where the second
        motion leaves all feature points still along the axes of their FAPs.
    points_cosine : the cosine at the feature points alone, each axis in its FAPU; NaN likewise.
    """

    cosine: float
    scale: float
    overlap: float
    points: float
    points_cosine: float


@dataclass(frozen=True, eq=False)
class Kit:
    """A face with shapes of its own under ARKit's names: (N, 3) offsets in the file's axes, units and order."""

    name: str
    scene: FaceScene
    points: FeaturePoints
    shapes: Mapping[str, Floats]

    @cached_property
    def face(self) -> PreparedFace:
        return prepare(self.scene, self.points, "target")

    @cached_property
    def seen(self) -> Bools:
        """(n,) visible vertices of the prepared skin."""
        return visible(self.face.skin)

    @cached_property
    def mirror(self) -> Places:
        """Where the mirror image of each vertex of the skin lies on the skin."""
        skin, flip = self.face.skin, np.array([-1.0, 1.0, 1.0])
        middle = 2.0 * np.array([float(skin.positions["9.15"][0]), 0.0, 0.0])
        mesh = PolyMesh.from_faces(skin.vertices, skin.triangles)
        return nearest_facing(skin.vertices * flip + middle, skin.normals * flip, mesh)

    def shape_set(self, names: list[str]) -> ShapeSet:
        """Shapes in the order of the names."""
        neutral = to_file_order(self.scene, self.scene.world_neutral())
        return ShapeSet(tuple(names), neutral, np.stack([self.shapes[name] for name in names]))

    def on_skin(self, deltas: Floats) -> Floats:
        """Offsets (n, 3) of the prepared skin, in eye separations."""
        face = self.face
        return face.skin.join(face.scene.scatter(face.scene.frame.from_file(deltas))) / face.fapu.es0

    def fap_values(self, offsets: Floats) -> dict[int, float]:
        """FAP values that the feature points of the skin show."""
        skin = self.face.skin
        ids = list(skin.points)
        moved = (skin.point_matrix(ids) @ offsets) * self.face.fapu.es0
        return fap_values(dict(zip(ids, moved, strict=True)), self.face.fapu)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", type=Path, default=SHARED)
    parser.add_argument("--backends", default=",".join(b.name for b in backends()), help="names, by commas")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--sheet", type=Path, help="draw all rows here")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    kits = {kit.name: kit for kit in read_kits(options.faces)}
    names = options.backends.split(",")
    results: dict[str, dict[str, dict[str, Agreement]]] = {}
    sheet = Sheet()
    for source, target in PAIRS:
        if source in kits and target in kits:
            pair = f"{source} to {target}"
            results[pair] = {}
            for name in names:
                cloned = cloned_shapes(kits[source], kits[target], name)
                results[pair][name] = agreements(kits[target], cloned)
                print_rows(f"{pair}, {name}", results[pair][name])
                if name == names[0]:
                    sheet.add_row(pair, pictures(kits[target], cloned))
    for kit in kits.values():
        sheet.add_row(f"{kit.name}'s own", pictures(kit, kit.shapes), SHOWN)
    sheet.rows.sort(key=lambda row: ROWS.index(row.label))
    floors = {name: floor(kit) for name, kit in kits.items()}
    for name, found in floors.items():
        print_rows(f"{name}, left mirrored against right", found)
    if options.json is not None:
        options.json.write_text(json.dumps(_plain(results, floors), indent=2))
    if options.sheet is not None:
        sheet.save(options.sheet)
    if options.write:
        sheet.rows = [row for row in sheet.rows if row.label in PUBLIC]
        sheet.save(DOCS / "images" / "cross_kit.png")
        put_tables(DOCS / "cross_kit.md", {"means": means_table(results, floors), "shapes": shapes_table(results)})


def read_kits(faces: Path) -> Iterator[Kit]:
    """The kits whose folders are there."""
    if (faces / "faces" / "makehuman").is_dir():
        head = known(source_head(open_makehuman(faces / "faces" / "makehuman")), ARKIT)
        shapes = head.shapes(ARKIT)
        yield Kit("MakeHuman", head.scene, head.points, dict(zip(shapes.names, shapes.deltas, strict=True)))
    kit = faces / "faces" / "ict-facekit"
    if kit.is_dir():
        scene = read_scene(kit / "generic_neutral_mesh.obj")
        shapes = read_shapes(kit / "expressions.npz", scene)
        points = read_kit_points(faces / "landmarks" / "ict.json", scene)
        yield Kit("ICT", scene, points, arkit_shapes(shapes.names, shapes.deltas))
    avatar = faces / "faces" / "rpm-brunette" / "brunette-t.glb"
    if avatar.exists():
        scene = read_scene(avatar)
        shapes = read_shapes(avatar, scene)
        yield Kit("RPM", scene, read_landmarks(RPM_POINTS, scene), arkit_shapes(shapes.names, shapes.deltas))


def cloned_shapes(source: Kit, target: Kit, backend: str) -> dict[str, Floats]:
    """The shapes that both kits have, cloned from one onto the other."""
    both = [name for name in ARKIT if name in source.shapes and name in target.shapes]
    made, _ = clone_shapes(
        source.scene, source.points, source.shape_set(both), target.scene, target.points, backend=backend
    )
    return dict(zip(made.names, made.deltas, strict=True))


def agreements(target: Kit, cloned: Mapping[str, Floats]) -> dict[str, Agreement]:
    """Cloned shapes against the target's own, where both move visible skin."""
    found = {}
    for name, deltas in cloned.items():
        mine, theirs = target.on_skin(deltas), target.on_skin(target.shapes[name])
        if min(np.abs(mine[target.seen]).max(), np.abs(theirs[target.seen]).max()) > STILL:
            found[name] = agreement(target, mine, theirs)
    return found


def floor(kit: Kit) -> dict[str, Agreement]:
    """Shapes of the left side, mirrored, against those of the right: what one artist's two sides differ by."""
    found = {}
    for name, deltas in kit.shapes.items():
        other = mirror_shape(name)
        if name.endswith("Left") and other in kit.shapes:
            mine, theirs = kit.on_skin(deltas), kit.on_skin(kit.shapes[other])
            if min(np.abs(mine[kit.seen]).max(), np.abs(theirs[kit.seen]).max()) > STILL:
                found[name] = agreement(kit, kit.mirror.carry(mine) * [-1.0, 1.0, 1.0], theirs)
    return found


def agreement(kit: Kit, mine: Floats, theirs: Floats) -> Agreement:
    """Compare two motions of a kit's skin, (n, 3) in eye separations."""
    one, other = kit.fap_values(mine), kit.fap_values(theirs)
    at_points = [np.array([values[k] for k in sorted(other)]) for values in (one, other)]
    units = np.array([kit.face.fapu.unit(fap(k).unit) for k in sorted(other)]) / kit.face.fapu.es0
    still = float(np.abs(at_points[1] * units).max()) < STILL
    return Agreement(
        cosine(mine[kit.seen], theirs[kit.seen]),
        best_scale(mine[kit.seen], theirs[kit.seen]),
        overlap(mine[kit.seen], theirs[kit.seen]),
        float("nan") if still else fap_error(other, one).relative,
        float("nan") if still else cosine(*at_points),
    )


def cosine(one: Floats, other: Floats) -> float:
    """Cosine of the angle between two fields, all numbers in a row; 0 where one of them is still."""
    sizes = float(np.linalg.norm(one)) * float(np.linalg.norm(other))
    return float(np.sum(one * other)) / sizes if sizes else 0.0


def best_scale(one: Floats, other: Floats) -> float:
    """The factor by which the first field comes nearest to the second, in the least squares sense."""
    square = float(np.sum(one * one))
    return float(np.sum(one * other)) / square if square else 0.0


def overlap(one: Floats, other: Floats) -> float:
    """Vertices that move in both, as a share of those that move in either (P. Jaccard, 1901)."""
    sizes = [np.linalg.norm(field, axis=1) for field in (one, other)]
    moving = [size > MOVING * size.max(initial=0.0) for size in sizes]
    either = int(np.count_nonzero(moving[0] | moving[1]))
    return float(np.count_nonzero(moving[0] & moving[1])) / either if either else 1.0


def mean(found: Mapping[str, Agreement]) -> Agreement:
    """Mean of each number over the shapes; of the scales and of what has no bound, the median."""
    columns = {key: [asdict(a)[key] for a in found.values()] for key in Agreement.__dataclass_fields__}
    medians = ("scale", "points")
    return Agreement(**{k: float(np.nanmedian(v) if k in medians else np.nanmean(v)) for k, v in columns.items()})


def print_rows(title: str, found: Mapping[str, Agreement]) -> None:
    print(f"{title:40}" + "".join(f"{key:>15}" for key in Agreement.__dataclass_fields__))
    for name, row in [*found.items(), ("mean (scale, points: median)", mean(found))]:
        print(f"  {name:38}" + "".join(f"{value:15.2f}" for value in asdict(row).values()))


def means_table(
    results: Mapping[str, Mapping[str, Mapping[str, Agreement]]], floors: Mapping[str, Mapping[str, Agreement]]
) -> str:
    """One line for each pair and backend, and one for each kit's own two sides."""
    lines = ["| | backend | shapes | cosine | best scale | overlap | points | cosine at points |", "|---" * 8 + "|"]
    rows = [(pair, name, found) for pair, by_name in results.items() for name, found in by_name.items()]
    rows += [(f"{kit}: left mirrored / right", "", found) for kit, found in floors.items()]
    for pair, name, found in rows:
        m = mean(found)
        cells = " | ".join(f"{value:.2f}" for value in asdict(m).values())
        lines.append(f"| {pair} | {name} | {len(found)} | {cells} |")
    return "\n".join(lines) + "\n"


def shapes_table(results: Mapping[str, Mapping[str, Mapping[str, Agreement]]]) -> str:
    """One line a shape, for the first backend of each pair; right sides, which are mirror images, are left out."""
    firsts = {pair: next(iter(by_name.values())) for pair, by_name in results.items()}
    lines = ["| shape | " + " | ".join(firsts) + " |", "|---" * (len(firsts) + 1) + "|"]
    for name in ARKIT:
        if not name.endswith("Right") and any(name in found for found in firsts.values()):
            cells = [_cell(found.get(name)) for found in firsts.values()]
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(row: Agreement | None) -> str:
    if row is None:
        return ""
    return " / ".join("-" if np.isnan(value) else f"{value:.2f}" for value in asdict(row).values())


def pictures(kit: Kit, shapes: Mapping[str, Floats]) -> list[UInt8]:
    """Some shapes in pictures, without hair, glasses and clothes, which would hide them."""
    scene = kit.face.scene
    hidden = {}
    for shape in scene.with_role(Role.OTHER):
        no_faces = PolyMesh(shape.mesh.vertices, np.zeros(0, np.int32), np.zeros(1, np.int32))
        hidden[shape.name] = replace(shape, mesh=no_faces, materials=())
    figure = Figure(scene.map_shapes(hidden), kit.face.points, Style(natural=True))
    renderer = make_renderer("software")
    out = []
    for name in SHOWN:
        moved = scene.scatter(scene.world_neutral() + scene.frame.from_file(shapes[name]))
        out.append(figure.draw(moved, PICTURE, renderer=renderer))
    return out


def _plain(results: object, floors: Mapping[str, Mapping[str, Agreement]]) -> dict[str, object]:
    def plain(value: object) -> object:
        if isinstance(value, Agreement):
            return asdict(value)
        return {k: plain(v) for k, v in value.items()} if isinstance(value, Mapping) else value

    return {"pairs": plain(results), "floors": plain(floors)}


if __name__ == "__main__":
    main()
