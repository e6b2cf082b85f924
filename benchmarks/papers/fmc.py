"""Pandzic (2001), Facial Motion Cloning: figures 5, 6, 8, 9 and 11 to 13."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.papers.cast import Cast
from benchmarks.papers.pictures import save
from cloning.align import anchor_ids
from cloning.antialias import SUPPORT
from cloning.prepare import PreparedFace
from cloning.published import align_plane, build_published, project
from cloning.source import source_motions
from fat.quality import flips, roughness
from fba.arrays import Floats, Ints
from fba.faps import EXPRESSION_FAP, VISEME_FAP
from studio.comparing import compare
from studio.comparison import Comparison, Mean, Way
from studio.motions import parse_motions
from studio.render import Figure, make_renderer
from studio.render.camera import Camera
from studio.render.drawable import Drawable, same_place, smooth_normals
from studio.sheet import Sheet, UInt8

MOTIONS = "surprise,viseme_ih,combination,combination-both-brows"
FIGURES = ("fmc_11_surprise", "fmc_12_viseme", "fmc_13_combination", "fmc_13_both_brows")
REPAIRED = tuple(Way(name) for name in ("fmc", "vtc", "vtc-image", "dt", "ec", "fit"))
PUBLISHED = tuple(Way(name, True) for name in ("fmc", "vtc", "dt", "ec", "fit"))
"""The published vtc is its paper's way with the mesh image, so vtc-image has none of its own."""
GENERATIONS = 3
SHOWN = 14
"""The viseme of figure 8: rounded lips."""
UNEVEN, SEED = 0.3, 8
"""Spread by which each vertex of an uneven source moves too far or too little, and the seed of the noise."""
PICTURE, FINE = (460, 380), 3
"""A picture of the projection, pixels, and how much larger it is drawn before it is made smaller."""
MOUTH, LOWER_FACE = 0.3, 0.5
"""Share of the face's picture that is shown."""
CELL = 150
FRONT = ("2", "3", "4", "5", "8", "9")
"""Groups of feature points that frame the picture of the projection."""
GREY, BLUE, RED = (150, 150, 155), (60, 110, 200), (205, 60, 50)
LIP_COLORS = np.array([[0.82, 0.80, 0.78], [0.85, 0.35, 0.30], [0.30, 0.45, 0.85]])
"""Out of the lip region, upper, lower."""
UPPER_LIP, LOWER_LIP = 1, 2


def reproduce(cast: Cast, images: Path, tell: Callable[[str], None]) -> dict[str, str]:
    """Draw the figures into a folder; the tables, by the name of their place in the page."""
    tell("figures 5 and 6")
    save(projection(cast), images / "fmc_5_6_projection.png")
    tell("figure 8")
    sheet, table = antialiasing(cast)
    save(sheet.image(), images / "fmc_8_antialiasing.png")
    tables = {"fmc-8": table}
    tell("figure 9")
    sheet, tables["fmc-9"] = lip_regions(cast)
    save(sheet.image(), images / "fmc_9_lip_regions.png")
    tell("figures 11 to 13")
    grids = compare(cast.grid, cast.grid, parse_motions(MOTIONS), (Way("fmc"),), cell=CELL)
    for name, grid in zip(FIGURES, grids.grids, strict=True):
        save(grid.image(), images / f"{name}.png")
    tables["fmc-grid"] = cells_table(grids)
    tell("all backends on the same motions")
    tables["fmc-backends"] = backends(cast, images)
    tell("generations")
    again = compare(
        cast.grid[:1],
        cast.grid[1:],
        parse_motions(MOTIONS),
        (Way("fmc"), Way("fit")),
        generations=GENERATIONS,
        cell=CELL,
    )
    save(again.grids[0].image(), images / "fmc_generations.png")
    tables["fmc-generations"] = generations_table(again)
    return tables


def backends(cast: Cast, images: Path) -> str:
    """The shipped source onto the others by all backends: figure 13 in both modes, the means of all motions."""
    means: list[Mean] = []
    for ways, name in ((REPAIRED, "fmc_13_backends"), (PUBLISHED, "fmc_13_published")):
        found = compare(cast.grid[:1], cast.grid[1:], parse_motions(MOTIONS), ways, cell=CELL)
        save(found.grids[2].image(), images / f"{name}.png")
        means += found.means()
    return means_table(means)


def projection(cast: Cast) -> Image.Image:
    """Source and target in the projected plane, before and after the target's feature points are moved."""
    source, target = cast.source, cast.target
    ids = anchor_ids(source.skin, target.skin)
    mine, yours = project(source, ids), project(target, ids)
    moved = align_plane(yours.plane, yours.points, mine.points)
    panels = [
        (mine.plane, source.skin.edges, mine.points, GREY, None),
        (yours.plane, target.skin.edges, yours.points, BLUE, mine.points),
        (moved, target.skin.edges, mine.points, BLUE, None),
    ]
    front = mine.points[[key.split(".")[0] in FRONT for key in ids]]
    low, high = front.min(axis=0) - 0.2, front.max(axis=0) + 0.2
    sheet = Sheet()
    names = (f"{cast.source_name}, projected", f"{cast.target_name}, projected", "moved onto the source's points")
    sheet.add_row("", [_plane(*panel, low, high) for panel in panels], names)
    return sheet.image()


def _plane(
    plane: Floats,
    edges: Ints,
    points: Floats,
    color: tuple[int, int, int],
    goals: Floats | None,
    low: Floats,
    high: Floats,
) -> UInt8:
    """A mesh in the plane, its feature points as dots, lines to where they are to go."""
    width, height = FINE * PICTURE[0], FINE * PICTURE[1]
    image = Image.new("RGB", (width, height), (255, 255, 255))
    draw = ImageDraw.Draw(image)

    def at(places: Floats) -> Floats:
        shares = (places - low) / (high - low)
        flat: Floats = np.stack([shares[:, 0] * width, (1.0 - shares[:, 1]) * height], axis=1)
        return flat

    flat = at(plane)
    short = np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1) < 0.2 * width  # not across the seam
    for a, b in edges[short].tolist():
        draw.line((*flat[a], *flat[b]), fill=color, width=FINE - 1)
    if goals is not None:
        for a, b in zip(at(points), at(goals), strict=True):
            draw.line((*a, *b), fill=RED, width=2 * FINE)
    for x, y in at(points):
        draw.ellipse((x - 3 * FINE, y - 3 * FINE, x + 3 * FINE, y + 3 * FINE), fill=RED)
    return np.asarray(image.resize(PICTURE, Image.Resampling.LANCZOS))


def antialiasing(cast: Cast) -> tuple[Sheet, str]:
    """The published method from a dense source to a coarse target, without and with its filter.

    The source once as it is, and once uneven, as a face is whose motions were made by hand.
    """
    source, target = cast.source, cast.target
    motions = [m for m in source_motions(cast.grid_face) if m.fap_id in (VISEME_FAP, EXPRESSION_FAP)]
    skins = np.stack([source.skin.join(m.offsets) for m in motions], axis=1)
    shown = next(k for k, m in enumerate(motions) if (m.fap_id, m.select) == (VISEME_FAP, SHOWN))
    noise = np.random.default_rng(SEED).normal(1.0, UNEVEN, (len(skins), 1, 1))
    sheet = Sheet()
    lines = ["| the source's motion | filter | flips, % | roughness | of the lower lip |", "|---|---|---|---|---|"]
    for name, given in (("as it is", skins), (f"uneven by {100 * UNEVEN:.0f} %", skins * noise)):
        lines.append(f"| {name} | the source itself | {_evenness(source, given)} |")
        pictures = [_mouth(source, given[:, shown])]
        for support in (0.0, SUPPORT):
            moved = build_published(source, target, support).apply(given)
            lines.append(f"| {name} | {support:g} | {_evenness(target, moved)} |")
            pictures.append(_mouth(target, moved[:, shown]))
        sheet.add_row(name, pictures, ["source", "one sample", f"mean over a radius of {SUPPORT:g}"])
    return sheet, "\n".join(lines) + "\n"


def _evenness(face: PreparedFace, moved: Floats) -> str:
    """Columns of the table: triangles that turn over, roughness of all skin and of the lower lip, motions' mean."""
    skin, edges = face.skin, face.skin.edges
    lip = edges[(face.labels.values[edges] == LOWER_LIP).all(axis=1)]
    each = np.moveaxis(moved, 1, 0)
    turned = [flips(skin.vertices, skin.triangles, m / face.fapu.es0) for m in each]
    rough, lips = ([roughness(some, m) for m in each] for some in (edges, lip))
    return f"{np.mean(turned):.2f} | {np.mean(rough):.3f} | {np.mean(lips):.3f}"


def _mouth(face: PreparedFace, moved: Floats) -> UInt8:
    """The moved mouth from near."""
    figure = Figure(face.scene, face.points)
    world = {n: face.scene.world_vertices(n) + part for n, part in face.skin.split(moved).items()}
    return figure.draw(world, (360, 320), _near(face, figure, MOUTH), make_renderer("software"))


def _near(face: PreparedFace, figure: Figure, share: float) -> Camera:
    """A camera that shows a share of the picture around the mouth."""
    middle = 0.5 * (face.place("8.1") + face.place("2.1"))
    camera = figure.camera
    return replace(
        camera,
        target=tuple(float(c) for c in middle),
        half_height=share * camera.half_height,
        half_width=share * camera.half_width,
    )


def lip_regions(cast: Cast) -> tuple[Sheet, str]:
    """Lip regions by polygons, as published, above the labels of the default mode; how they agree."""
    sheet = Sheet()
    faces = {cast.source_name: cast.source, cast.target_name: cast.target}
    ids = anchor_ids(cast.source.skin, cast.target.skin)
    polygons = {name: project(face, ids).lips for name, face in faces.items()}
    labels = {n: np.where(f.labels.values <= LOWER_LIP, f.labels.values, 0) for n, f in faces.items()}
    sheet.add_row("polygons (published)", [_colored(face, polygons[name]) for name, face in faces.items()])
    sheet.add_row("labels along the skin (default)", [_colored(f, labels[n]) for n, f in faces.items()], list(faces))
    lines = ["| face | lip | vertices | same, % | other lip, % | neither, % |", "|---|---|---|---|---|---|"]
    for name in faces:
        for lip, word in ((UPPER_LIP, "upper"), (LOWER_LIP, "lower")):
            said = polygons[name][labels[name] == lip]
            shares = [100 * np.mean(said == region) for region in (lip, UPPER_LIP + LOWER_LIP - lip, 0)]
            lines.append(f"| {name} | {word} | {len(said)} | {' | '.join(f'{share:.1f}' for share in shares)} |")
    return sheet, "\n".join(lines) + "\n"


def _colored(face: PreparedFace, regions: Ints) -> UInt8:
    vertices = face.skin.vertices * face.fapu.es0
    normals = smooth_normals(vertices, face.skin.triangles, same_place(vertices))
    camera = _near(face, Figure(face.scene, face.points), LOWER_FACE)
    drawn = Drawable(vertices, face.skin.triangles, LIP_COLORS[regions], normals)
    return make_renderer("software").render([drawn], camera, 360, 320)


def cells_table(found: Comparison) -> str:
    """Rows of figures 11 to 13 in numbers: worst and mean over the targets of a source."""
    lines = ["| source | motion | FP error, mean | worst | flips, % | source's own |", "|---|---|---|---|---|---|"]
    for source in dict.fromkeys(c.source for c in found.cells):
        for motion in dict.fromkeys(c.motion for c in found.cells):
            cells = [c for c in found.cells if (c.source, c.motion) == (source, motion)]
            errors = [c.fp_error for c in cells]
            lines.append(
                f"| {source} | {motion} | {np.mean(errors):.4f} | {max(errors):.4f} | "
                f"{np.mean([c.flips for c in cells]):.2f} | {cells[0].source_flips:.2f} |"
            )
    return "\n".join(lines) + "\n"


def means_table(means: Sequence[Mean]) -> str:
    """One line for each backend and mode, the modes of one backend together."""
    order = [way.backend for way in REPAIRED]
    lines = ["| backend | FP error | flips, % | source's | stretch | source's |", "|---|---|---|---|---|---|"]
    for m in sorted(means, key=lambda m: order.index(m.backend)):
        lines.append(
            f"| {Way(m.backend, m.as_published)} | {m.fp_error:.4f} | {m.flips:.2f} | {m.source_flips:.2f} | "
            f"{m.stretch:.2f} | {m.source_stretch:.2f} |"
        )
    return "\n".join(lines) + "\n"


def generations_table(found: Comparison) -> str:
    """One line for each backend and generation."""
    lines = ["| backend | generation | FP error | flips, % | stretch | drift |", "|---|---|---|---|---|---|"]
    for m in found.means():
        drift = "-" if m.drift is None else f"{m.drift:.3f}"
        lines.append(f"| {m.backend} | {m.generation} | {m.fp_error:.4f} | {m.flips:.2f} | {m.stretch:.2f} | {drift} |")
    return "\n".join(lines) + "\n"
