"""How exact and how fast vertex tents are, beside deformation transfer; pictures beside Expression Cloning.

    python -m benchmarks.vtc [--write] [--pictures FOLDER] [--json FILE]

Self mapping: the shipped source's skin is given its own motions, through the solvers alone (tents on its quadrangles,
tents and deformation transfer on their triangles), through the whole backend `vtc`, through that of `vtc-image` as far
as the mesh image shows the skin, and through the paper's own way from its correspondence to its result in the source's
topology. Error of a vertex: |length of its motion / true length - 1|, where it moves more than 0.1 % of the motion's
largest offset. Speed: the same skin with every polygon fanned from its middle, the largest ones twice, 88 motions.
Seconds are those of the processor. --write puts the tables into docs/backends/vtc.md and the pictures into docs/images.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.deformation import BANDS, MOTIONS, STILL, errors, line
from benchmarks.papers.pictures import save
from cloning import clone, vtc, vtc_image
from cloning.deformation import deformation_transfer
from cloning.prepare import PreparedFace, prepare
from cloning.recast import build_recast
from cloning.resampling import resample
from cloning.source import source_motions
from cloning.surface import Surface
from cloning.tents import tent_transfer
from fat import AnimatableFace
from fat.evaluate import Player
from fba.arrays import Floats, Ints
from fba.high_level import BLEND_MAX
from fba.scene import Role
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from samples.build.arkit_docs import put_tables
from studio.render import Figure, make_renderer
from studio.render.camera import frame_face
from studio.render.drawable import Drawable
from studio.sheet import Sheet, UInt8

COLORS = np.array([(0.25, 0.65, 0.30), (0.20, 0.35, 0.85), (0.85, 0.20, 0.20), (0.25, 0.05, 0.05)])
"""Of the bands below 0.1 %, 0.5 %, 2 %, and of more."""

RESTS = np.array((0.85, 0.82, 0.80))
DOCS = Path(__file__).resolve().parents[1] / "docs"
COUNT = 19_142
"""Vertices of the faces that the paper gives its seconds for."""

JOY, EXPRESSIONS = 1, (("joy", 1), ("surprise", 6))
SIZE = (300, 360)


@dataclass(frozen=True)
class Mapped:
    """Motions given back to the face that they come from: (n, K, 3), and which vertices took part."""

    name: str
    found: Floats
    kept: Any


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    source = read_face("default")
    face = prepare(source.scene, source.feature_points, "source")
    motions = skin_motions(source, face)
    headings = ("", *(f"< {band:.1%}" for band in BANDS), "largest")
    print(f"{'self mapping':42}" + "".join(f"{heading:>12}" for heading in headings))
    rows: list[dict[str, Any]] = []
    for mapped in self_mapped(face, motions):
        row = errors(mapped.found[mapped.kept], motions[mapped.kept])
        rows.append({"mesh": mapped.name, "system": "", **row})
        print(f"{mapped.name:42}" + line({**rows[-1], "mesh": ""})[20:])
    seconds = speed(face, motions)
    for name, value in seconds.items():
        print(f"{name:70}{value:10.3f}")
    pictures = DOCS / "images" if options.write else options.pictures
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for name, sheet in (("self_mapping", error_maps(source, face)), ("beside_others", side_by_side(source))):
            save(sheet.image(), pictures / f"vtc_{name}.png")
    if options.write:
        tables = {"self mapping": self_mapping_table(rows), "speed": speed_table(seconds)}
        put_tables(DOCS / "backends" / "vtc.md", tables)
    if options.json is not None:
        options.json.write_text(json.dumps([*rows, seconds], indent=2))


def skin_motions(source: AnimatableFace, face: PreparedFace) -> Floats:
    """(n, 88, 3) the moving tables of the shipped source, repeated, mesh units."""
    every = [face.skin.join(m.offsets) for m in source_motions(source)]
    moving = [m for m in every if m.any()]
    return np.stack([moving[k % len(moving)] for k in range(MOTIONS)], axis=1)


def self_mapping_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows of self mapping as they stand in the docs."""
    head = "| way | " + " | ".join(f"< {band:.1%}" for band in BANDS) + " | largest error / largest motion |\n"
    lines = []
    for row in rows:
        shares = " | ".join(f"{100.0 * row[f'below {band:.1%}']:.4g} %" for band in BANDS)
        lines.append(f"| {row['mesh']} | {shares} | {row['largest']:.0e} |")
    return head + "|---" * (len(BANDS) + 2) + "|\n" + "\n".join(lines) + "\n"


def speed_table(seconds: Mapping[str, float]) -> str:
    """What took how long, as it stands in the docs."""
    lines = [f"| {name} | {value:.2g} |" for name, value in seconds.items()]
    return "| | measured |\n|---|---|\n" + "\n".join(lines) + "\n"


def self_mapped(face: PreparedFace, motions: Floats) -> list[Mapped]:
    """The motions given back in every way."""
    everything = np.ones(len(motions), bool)
    whole = Mapped("backend vtc", vtc.build_transfer(face, face, False).apply(motions), everything)
    by_image = vtc_image.build_transfer(face, face, False).apply(motions)
    papers = build_recast(face, face)[1]
    kept = resample(face.skin, face.skin).kept
    found = np.zeros(motions.shape)
    found[kept] = papers.apply(motions)
    image = Mapped("backend vtc-image, skin in the mesh image", by_image, kept)
    return [*by_solvers(face, motions), whole, image, Mapped("vtc as published", found, kept)]


def by_solvers(face: PreparedFace, motions: Floats) -> list[Mapped]:
    """The motions through the equations alone."""
    skin, es0 = face.skin, face.fapu.es0
    still = (~motions.any(axis=(1, 2))).astype(float)
    cut = skin.triangles.ravel(), 3 * np.arange(len(skin.triangles) + 1, dtype=np.int32)
    everything = np.ones(skin.vertex_count, bool)
    out = []
    for name, polygons in (("tents, quadrangles", skin.polygons), ("tents, triangles", cut)):
        tents = tent_transfer(skin.vertices, skin.vertices, polygons, still, links=skin.links)
        out.append(Mapped(name, tents.apply(motions / es0) * es0, everything))
    triangles = deformation_transfer(skin.vertices, skin.vertices, skin.triangles, still, links=skin.links)
    out.append(Mapped("deformation transfer", triangles.apply(motions / es0) * es0, everything))
    return out


def dense(skin: Surface, motions: Floats | None = None, count: int = 0) -> tuple[Surface, Floats]:
    """Every polygon fanned from its middle, the largest of the triangles once more; and the motions there.

    Parameters
    ----------
    count : of vertices to reach; 0 = as many as there are after the first time.
    """
    motions = np.zeros((skin.vertex_count, 1, 3)) if motions is None else motions
    skin, motions = fanned(skin, motions, np.arange(len(skin.polygons[1]) - 1, dtype=np.int32))
    a, b, c = (skin.vertices[skin.triangles[:, k]] for k in range(3))
    size = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    more = max(count - skin.vertex_count, 0)
    return fanned(skin, motions, np.argsort(-size, kind="stable")[:more].astype(np.int32))


def fanned(skin: Surface, motions: Floats, some: Ints) -> tuple[Surface, Floats]:
    """Fan some polygons from their middles; the others are triangulated."""
    indices, offsets = skin.polygons
    arity = np.diff(offsets)
    following = np.arange(indices.size) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    polygon = np.repeat(np.arange(len(arity)), arity)
    number = np.full(len(arity), -1)
    number[some] = np.arange(len(some))
    corner = np.flatnonzero(number[polygon] >= 0)
    middle = skin.vertex_count + number[polygon[corner]]
    others = skin.triangles[number[np.repeat(np.arange(len(arity)), arity - 2)] < 0]
    fans = np.concatenate([others, np.stack([indices[corner], indices[following[corner]], middle], axis=1)])

    def means(values: Floats) -> Floats:
        total = np.add.reduceat(values[indices], offsets[:-1])[some]
        return np.concatenate([values, total / arity[some].reshape(-1, *[1] * (values.ndim - 1))])

    fans = fans.astype(np.int32)
    polygons: tuple[Ints, Ints] = fans.ravel(), 3 * np.arange(len(fans) + 1, dtype=np.int32)
    return replace(skin, vertices=means(skin.vertices), polygons=polygons, triangles=fans), means(motions)


def speed(face: PreparedFace, motions: Floats) -> dict[str, float]:
    """Seconds of the paper's correspondence and of set-up, milliseconds of one motion."""
    scene = read_scene(sample("faces/tri_head.obj"))
    points = read_landmarks(sample("faces/tri_head.fps.json"), scene)
    other = prepare(scene, points, "target").skin
    skin, many = dense(face.skin, motions / face.fapu.es0, COUNT)
    target = dense(dense(other)[0])[0]
    start = process_time()
    copy = resample(skin, target)
    found = process_time()
    held = np.where(many.any(axis=(1, 2)), 0.01, 1.0)
    transfer = tent_transfer(skin.vertices, copy.vertices, copy.polygons, held, links=skin.links)
    ready = process_time()
    transfer.apply(many, wishes=many)
    done = process_time()
    sizes = f"{skin.vertex_count:,} vertices, {len(skin.triangles):,} triangles"
    return {
        f"correspondence, {sizes} onto {target.vertex_count:,} vertices, seconds (paper: 1.5)": found - start,
        "set-up of the transfer, seconds (paper: not counted)": ready - found,
        f"one motion of {MOTIONS}, milliseconds (paper: 1,100)": (done - ready) / MOTIONS * 1e3,
    }


def error_maps(source: AnimatableFace, face: PreparedFace) -> Sheet:
    """Joy given back to the source: deformation transfer, tents, and the paper's own way with its mesh image."""
    joy = next(m for m in source_motions(source, frozenset((2,))) if m.select == JOY and m.value == BLEND_MAX)
    motion = face.skin.join(joy.offsets)[:, None]
    motions = np.concatenate([motion, skin_motions(source, face)], axis=1)
    mapped = {m.name: m for m in self_mapped(face, motions)}
    sheet = Sheet("Joy given back to the source: green < 0.1 %, blue < 0.5 %, red < 2 %, black above; grey rests")
    names = ("deformation transfer", "tents, quadrangles", "vtc as published")
    pictures = [error_map(face, motion[:, 0], mapped[name]) for name in names]
    sheet.add_row("", pictures, names)
    return sheet


def error_map(face: PreparedFace, truth: Floats, mapped: Mapped) -> UInt8:
    """The source's skin in the colours of the bands, the first motion's errors; redundant skin is left out."""
    skin, scene = face.skin, face.scene
    size = np.linalg.norm(truth, axis=1)
    ratio = np.abs(np.linalg.norm(mapped.found[:, 0], axis=1) / np.maximum(size, 1e-300) - 1.0)
    band = np.where(size > STILL * size.max(), np.searchsorted(BANDS, ratio, side="right"), -1)
    shown = skin.triangles[np.asarray(mapped.kept)[skin.triangles].all(axis=1)]
    worst = band[shown].max(axis=1)
    colors = np.where(worst[:, None] < 0, RESTS, COLORS[np.maximum(worst, 0)])
    vertices = skin.vertices * face.fapu.es0
    drawables = [Drawable(vertices, shown, colors, skin.normals)]
    drawables += [
        Drawable(scene.world_vertices(s.name), s.mesh.triangles, RESTS)
        for s in scene.shapes
        if s.role in (Role.EYE_LEFT, Role.EYE_RIGHT)
    ]
    return make_renderer("software").render(drawables, frame_face(scene, face.points), *SIZE)


def side_by_side(source: AnimatableFace) -> Sheet:
    """Joy and surprise of the source, and its clones by Expression Cloning, deformation transfer and tents."""
    scene = read_scene(sample("faces/tri_head.obj"))
    points = read_landmarks(sample("faces/tri_head.fps.json"), scene)
    sheet = Sheet("The source's expressions (left) by Expression Cloning, deformation transfer and vertex tents")
    names = ("ec", "dt", "vtc")
    for literal in (True, False):
        clones = [clone(source, scene, points, backend=n, as_published=literal, faps=(2,)) for n in names]
        for word, number in EXPRESSIONS:
            pictures = [posed(face, number) for face in (source, *clones)]
            mode = "as published" if literal else "default"
            sheet.add_row(f"{word}, {mode}", pictures, ("source", *names))
    return sheet


def posed(face: AnimatableFace, expression: int) -> UInt8:
    pose = Player(face).pose(expression=(expression, BLEND_MAX, 0, 0)).world_shapes()
    return Figure.of_face(face).draw(pose, (160, 192), renderer=make_renderer("software"))


if __name__ == "__main__":
    main()
