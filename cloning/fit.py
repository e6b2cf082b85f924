"""Backend `fit`: an elastic template finds the correspondence, displacements are scaled by FAPUs.

The source's skin is deformed until it lies on the target (after Xiang et al. 2008, section 3.2). Each of the target's
vertices then moves like its place on the deformed source, times the field of FAPU ratios; the closest point is exact,
among the triangles that face the same way and are not of the opposite lip or lid.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cloning.backends import SkinTransfer
from cloning.fmc import AlignedTransfer, scale_field
from cloning.locate import Places
from cloning.prepare import PreparedFace
from cloning.skin import FARTHEST, LEAST_FACING, map_of_places, refined
from cloning.template.closest import TriangleSearch
from cloning.template.fitting import BENDING, PUBLISHED, fit_template
from fba.arrays import Floats, Ints


def build_transfer(source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
    """Prepare the transfer between two faces; published mode fits with the paper's weights and knows no labels."""
    labels = None if as_published else (source.labels.values, target.labels.values)
    schedule = PUBLISHED if as_published else BENDING
    fitted = fit_template(source.skin, target.skin, labels=labels, schedule=schedule)
    refinements, fine, fine_labels = refined(source.skin, source.labels.values, target.skin)
    vertices = fitted.vertices
    for step in refinements:
        vertices = step.matrix @ vertices
    search = TriangleSearch(vertices, fine.triangles, None if as_published else fine_labels)

    def find(points: Floats, normals: Floats, sides: Ints) -> Places:
        return search.closest(points, normals, None if as_published else sides, LEAST_FACING, FARTHEST)

    skin = target.skin
    places = find(skin.vertices, skin.normals, target.labels.values)
    skin_map = map_of_places(
        refinements,
        replace(fine, vertices=vertices),
        skin,
        target.labels,
        skin.vertices,
        places,
        find,
        scale_field(source, target),
    )
    return AlignedTransfer(
        skin_map,
        {
            **skin_map.health(),
            "fitted_share": float(fitted.valid.mean()),
            "fit_residual_es": float(np.mean(fitted.residual[fitted.valid])) if fitted.valid.any() else 0.0,
        },
        {
            "farthest_es": FARTHEST,
            "least_facing": LEAST_FACING,
            "refinements": len(skin_map.refinements),
            "schedule": "published" if as_published else "bending",
            "steps": schedule.steps,
        },
    )
