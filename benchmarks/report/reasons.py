"""Why a bar, or its aim, is not reached; keyed like the bars' values."""

from __future__ import annotations

REASONS: dict[str, str] = {
    "own feature point, %": (
        "rims of pupils and lids of coarse heads: single vertices have to stand for a ring or an edge"
    ),
    "feature points": (
        "the heads of 2,600 to 5,300 vertices, where feature points share triangles with others that move differently"
    ),
    "before, same": "a wider mouth and nose than the source's: the ratios blend between feature points",
    "before, other": (
        "the heads of 2,600 to 5,300 vertices, where feature points share triangles with others that move "
        "differently; the correction takes it to .001"
    ),
    "cross-talk, %": (
        "the heads of 2,600 to 5,300 vertices, where feature points share triangles with others that move differently"
    ),
    "truth, fit": (
        "with the true correspondence the same scaling and correction leave .07 to .09 on the source's own "
        "topology; the rest is where the template slides along smooth skin, and the decimated target"
    ),
    "truth, others": "the same correspondence, and local changes that do not scale by FAPUs between the points",
    "lip gap, MNS": ("lips meet along polygons: between feature points a coarse edge cannot follow the source's curve"),
    "lid gap, IRISD": "lids of other polygons than the source's meet between vertices",
    "flips, %": "coarse triangles beside lids and lips; the source folds nowhere",
    "points, mean": (
        "ICT-FaceKit, whose ears, jaw corners and skull points lie elsewhere than MakeHuman's (.23); the "
        "points of its face alone are .075 off ([landmarks.md](landmarks.md))"
    ),
    "points, largest": ("the same: jaw corners and ears of ICT-FaceKit; points of its face alone miss by .24 at most"),
    "motions, dt, 20k": ("a quarter is triangular solves of 264 right sides, a quarter sparse products, both in scipy"),
    "motions, vtc, 20k": "as DT, with a ring more of neighbours in the matrix",
    "whole clone": ("half is finding the feature points, with two fits of its own, and the fit itself"),
    "fit, 5k": "twenty steps, each with closest points and one factor",
    "fit, 20k": "as at 5k, and the two factors of the whole template",
    "frames/s, 20k": (
        "every FAP, two visemes and two expressions at once, other values in each frame, with all combination rules"
    ),
    "analogy, set-up": "one factor of all pixels in the mask and the warp",
    "analogy, expression": "a quarter is one solve; the rest warps and composes the picture",
    "read .wrl, 100k": "text is read number by number in numpy",
}
