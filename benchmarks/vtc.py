"""How exact and how fast vertex tents are, beside deformation transfer; pictures beside Expression Cloning.

    python -m benchmarks.vtc [--pictures FOLDER] [--json FILE]

Self mapping: the shipped source's skin is given its own motions, through the solvers alone (tents on its quadrangles,
tents and deformation transfer on their triangles), through the whole backend `vtc`, through the paper's own mesh image,
and through that of the outer skin alone, without mouth and sockets, which is what scans have. Error of a vertex:
|length of its motion / true length - 1|, where it moves more than 0.1 % of the motion's largest offset. Speed: the
same skin with every polygon fanned from its middle, 88 motions. Seconds are those of the processor.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.deformation import BANDS, MOTIONS, STILL, errors, line
from cloning import clone
from cloning.deformation import deformation_transfer
from cloning.prepare import PreparedFace, prepare
from cloning.resampling import resample
from cloning.source import source_motions
from cloning.surface import Surface
from cloning.tents import tent_transfer
from cloning.vtc import build_transfer
from cloning.vtc_image import build_published
from fat import AnimatableFace
from fat.evaluate import Player
from fba.arrays import Floats, Ints
from fba.high_level import BLEND_MAX
from fba.scene import Role
from formats import read_face, read_scene
from formats.landmarks import read_landmarks
from samples import sample
from studio.render import Figure, make_renderer
from studio.render.camera import frame_face
from studio.render.drawable import Drawable
from studio.sheet import Sheet, UInt8

COLORS = np.array([(0.25, 0.65, 0.30), (0.20, 0.35, 0.85), (0.85, 0.20, 0.20), (0.25, 0.05, 0.05)])
"""Of the bands below 0.1 %, 0.5 %, 2 %, and of more."""

RESTS = np.array((0.85, 0.82, 0.80))
FAINT = 1e-9
"""Holds parts that the mesh image cuts off, and nothing else."""

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
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    source = read_face("default")
    face = prepare(source.scene, source.feature_points, "source")
    motions = skin_motions(source, face)
    headings = ("", *(f"< {band:.1%}" for band in BANDS), "largest")
    print(f"{'self mapping':20}" + "".join(f"{heading:>12}" for heading in headings))
    rows: list[dict[str, Any]] = []
    for mapped in self_mapped(face, motions):
        row = errors(mapped.found[mapped.kept], motions[mapped.kept])
        rows.append({"mesh": mapped.name, "system": "", **row})
        print(f"{mapped.name:32}" + line({**rows[-1], "mesh": ""})[20:])
    for name, value in speed(face, motions).items():
        rows.append({name: value})
        print(f"{name:60}{value:10.3f}")
    if options.pictures is not None:
        options.pictures.mkdir(parents=True, exist_ok=True)
        for name, sheet in (("self_mapping", error_maps(source, face)), ("beside_others", side_by_side(source))):
            sheet.image().quantize(256).save(options.pictures / f"vtc_{name}.png", optimize=True)
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2))


def skin_motions(source: AnimatableFace, face: PreparedFace) -> Floats:
    """(n, 88, 3) the moving tables of the shipped source, repeated, mesh units."""
    every = [face.skin.join(m.offsets) for m in source_motions(source)]
    moving = [m for m in every if m.any()]
    return np.stack([moving[k % len(moving)] for k in range(MOTIONS)], axis=1)


def self_mapped(face: PreparedFace, motions: Floats) -> list[Mapped]:
    """The motions given back in every way."""
    whole = Mapped("backend vtc", build_transfer(face, face, False).apply(motions), np.ones(len(motions), bool))
    image, copy = build_published(face, face)
    published = Mapped("mesh image, as published", image.deform(motions) * face.fapu.es0, copy.kept)
    return [*by_solvers(face, motions), whole, published, by_outer_skin(face, motions)]


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


def by_outer_skin(face: PreparedFace, motions: Floats) -> Mapped:
    """The motions through the mesh image of what lies behind no other skin."""
    skin, es0 = face.skin, face.fapu.es0
    outer = resample(skin, skin, outermost=True)
    held = np.where(outer.kept & motions.any(axis=(1, 2)), FAINT, 1.0)
    tents = tent_transfer(skin.vertices, outer.vertices, outer.polygons, held, links=skin.links)
    found = tents.apply(motions / es0, wishes=motions / es0) * es0
    return Mapped("mesh image, outer skin", found, outer.kept)


def dense(skin: Surface, motions: Floats | None = None) -> tuple[Surface, Floats]:
    """Every polygon fanned from its middle, and the motions there."""
    motions = np.zeros((skin.vertex_count, 1, 3)) if motions is None else motions
    indices, offsets = skin.polygons
    arity = np.diff(offsets)
    starts = offsets[:-1]
    following = np.arange(indices.size) + 1
    following[offsets[1:] - 1] = starts
    middle = skin.vertex_count + np.repeat(np.arange(len(arity)), arity)
    fans = np.stack([indices, indices[following], middle], axis=1).astype(np.int32)

    def means(values: Floats) -> Floats:
        shape = (-1, *[1] * (values.ndim - 1))
        return np.concatenate([values, np.add.reduceat(values[indices], starts) / arity.reshape(shape)])

    polygons: tuple[Ints, Ints] = fans.ravel(), 3 * np.arange(len(fans) + 1, dtype=np.int32)
    return replace(skin, vertices=means(skin.vertices), polygons=polygons, triangles=fans), means(motions)


def speed(face: PreparedFace, motions: Floats) -> dict[str, float]:
    """Seconds of set-up, of one motion, and of the paper's correspondence."""
    scene = read_scene(sample("faces/tri_head.obj"))
    points = read_landmarks(sample("faces/tri_head.fps.json"), scene)
    other = prepare(scene, points, "target").skin
    skin, many = dense(face.skin, motions / face.fapu.es0)
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
        f"correspondence onto {target.vertex_count:,} vertices, seconds": found - start,
        f"set-up, {sizes}, seconds": ready - found,
        f"a motion of {MOTIONS}, milliseconds": (done - ready) / MOTIONS * 1e3,
    }


def error_maps(source: AnimatableFace, face: PreparedFace) -> Sheet:
    """Joy given back to the source: deformation transfer, tents, and the paper's mesh image."""
    joy = next(m for m in source_motions(source, frozenset((2,))) if m.select == JOY and m.value == BLEND_MAX)
    motion = face.skin.join(joy.offsets)[:, None]
    motions = np.concatenate([motion, skin_motions(source, face)], axis=1)
    mapped = {m.name: m for m in self_mapped(face, motions)}
    sheet = Sheet("Joy given back to the source: green < 0.1 %, blue < 0.5 %, red < 2 %, black above; grey rests")
    names = ("deformation transfer", "tents, quadrangles", "mesh image, outer skin")
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
