"""Song et al., vertex tents in 3D and in pictures: figures 10 to 15, and the timings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks import vtc as tents
from benchmarks.deformation import errors
from benchmarks.papers.cast import Cast
from benchmarks.papers.pictures import save
from benchmarks.papers.vtc_pictures import reproduce_pictures


def reproduce(cast: Cast, images: Path, tell: Callable[[str], None]) -> dict[str, str]:
    """Draw the figures into a folder; the tables, by the name of their place in the page."""
    face, source = cast.grid_face, cast.source
    tell("figure 10")
    save(tents.side_by_side(face).image(), images / "vtc_10_beside_others.png")
    tell("figure 11")
    motions = tents.skin_motions(face, source)
    rows = [
        {"mesh": mapped.name, "system": "", **errors(mapped.found[mapped.kept], motions[mapped.kept])}
        for mapped in tents.self_mapped(source, motions)
    ]
    save(tents.error_maps(face, source).image(), images / "vtc_11_self_mapping.png")
    tell("timings")
    solid = {"vtc-11": tents.self_mapping_table(rows), "vtc-times": tents.speed_table(tents.speed(source, motions))}
    return solid | reproduce_pictures(images, tell)
