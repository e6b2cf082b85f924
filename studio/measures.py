"""What `fba check` measures: each measure's meaning, how it is judged, its limits and where they come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Rule = Literal["limit", "beyond", "times"]


@dataclass(frozen=True, slots=True)
class Measure:
    """One measure of a face.

    Attributes
    ----------
    code, title, unit : for findings, for people, of the value.
    rule : what is held against the limits. "limit": the value itself, or where the source is worse than the limit, a
        tenth more than the source's. "beyond": the value less the source's. "times": the value over the source's.
    good, fail : up to `good` all is well, beyond `fail` the measure fails, between them it is fair.
    must : a face that fails it fails the check; others are told.
    floor : for "times", what the source's value counts at least.
    finer : for "times", the power of target's over source's edge length by which the measure grows on a coarser mesh.
    what : its definition.
    origin : where the limits come from.
    """

    code: str
    title: str
    unit: str
    rule: Rule
    good: float
    fail: float
    must: bool
    what: str
    origin: str
    floor: float = 0.0
    finer: float = 0.0


_STANDARD = "MPEG-4: values are integers, and a FAP is its feature point's way in FAPUs"
_VISIBLE = "the least that shows in a close-up"
_HEADS = "clones of the shipped source on the three shipped heads and ICT-FaceKit stay within it"

MEASURES: tuple[Measure, ...] = (
    Measure(
        "neutral",
        "neutral face moves",
        "eye sep.",
        "limit",
        0.0,
        0.0,
        True,
        "largest offset of a vertex when all FAPs are 0",
        "a player adds nothing to nothing: bit by bit the same",
    ),
    Measure(
        "fapu",
        "FAPUs against feature points",
        "%",
        "limit",
        0.5,
        5.0,
        False,
        "largest difference between a FAPU of the tables and the distance between the feature points that define it",
        "as far as a FAP may miss; beyond 5 % players that measure the face themselves move it visibly otherwise",
    ),
    Measure(
        "points",
        "misplaced feature point",
        "eye widths",
        "beyond",
        0.25,
        0.75,
        False,
        "largest distance of a feature point of brows, eyes, nose, mouth, cheeks or chin from where all other points "
        "say, by the smoothest warp from the source's points (each point left out in turn)",
        "a detected point may be off by .25; closed eyes of a head reach .6, real faces .3",
    ),
    Measure(
        "point-sides",
        "feature points on one side only",
        "eye widths",
        "limit",
        0.25,
        0.5,
        False,
        "largest distance of such a feature point from the mirror image of its counterpart, in the plane that suits "
        "all pairs best",
        "a detected point may be off by .25, and both sides by as much; a face's own two sides differ by less",
    ),
    Measure(
        "own-fp",
        "own feature point of a FAP",
        "%",
        "limit",
        0.1,
        0.5,
        True,
        "largest difference of a FAP's own feature point from the FAP's amount along its axis, where it is more than "
        "one FAP unit; rotations: of the part that turns; pupils: of their width across the gaze",
        _STANDARD,
    ),
    Measure(
        "cross-talk",
        "other FAPs' feature points",
        "%",
        "limit",
        1.0,
        5.0,
        True,
        "largest motion of another FAP's feature point, as a share of the own; tied lip corners and what the jaw "
        "carries are left out",
        "a twentieth of a motion is taken for none; motions of a face kit reach many times the own",
    ),
    Measure(
        "fp-error",
        "feature points, all motions",
        "relative",
        "limit",
        0.003,
        0.01,
        True,
        "sum over the axes of all FAPs of the differences from the source, in FAP units, over the source's motion; "
        "mean over all motions",
        "what correction at the feature points reaches, and three times that",
    ),
    Measure(
        "fp-error-worst",
        "feature points, worst motion",
        "relative",
        "limit",
        0.01,
        0.05,
        False,
        "the same of the worst motion",
        "what a mean within its limit may hide in one motion",
    ),
    Measure(
        "held-out",
        "feature points without a FAP",
        "relative",
        "limit",
        0.10,
        0.25,
        False,
        "the same at the points that no FAP names, in eye separations: no correction has touched them; all motions "
        "together",
        f"the state of a good clone before correction; {_HEADS} (.04 to .06)",
    ),
    Measure(
        "truth",
        "distance from the truth",
        "relative",
        "limit",
        0.2,
        0.35,
        False,
        "with --truth: size of all differences from the true offsets of the skin that is seen over the size of these "
        "(L2), mean over all motions; the worst is named",
        "heads of known motion, cloned onto another topology: .14 to .19 is reached",
    ),
    Measure(
        "truth-hidden",
        "distance from the truth, hidden skin",
        "relative",
        "limit",
        0.5,
        1.0,
        False,
        "the same of the skin that is hidden at rest",
        "as above: .27 is reached; beyond 1 it were better left still",
    ),
    Measure(
        "unasked",
        "motions that the source lacks",
        "motions",
        "limit",
        0.0,
        0.0,
        True,
        "motions that leave all feature points still on the source, but not on the face",
        "the source says what moves",
    ),
    Measure(
        "still",
        "back of the head",
        "eye sep.",
        "limit",
        0.001,
        0.002,
        True,
        "largest offset of what can be seen behind the ears in any motion but the ears' own",
        "a hair, .06 mm; what nothing pulls at must not move",
    ),
    Measure(
        "lip-gap",
        "lips open differently",
        "MNS",
        "limit",
        0.001,
        0.01,
        True,
        "largest difference of the lips' opening from the source's, at 2.2/2.3, 2.6/2.8 and 2.7/2.9",
        f"a tenth of a millimetre; {_VISIBLE}",
    ),
    Measure(
        "lip-depth",
        "lips sink into each other",
        "MNS",
        "beyond",
        0.02,
        0.1,
        False,
        "greatest depth of a lip's vertex below the other lip's skin, more than at rest and more than the source's",
        "sources press the lips together by .17; a tenth of the upper lip's height shows",
    ),
    Measure(
        "teeth",
        "lips cross the teeth",
        "% of the lips",
        "beyond",
        1.0,
        8.0,
        False,
        "share of the lips' triangles that cross a triangle of the teeth, but not at rest",
        f"{_HEADS} (ICT-FaceKit's thick gums: 6.7)",
    ),
    Measure(
        "tongue",
        "tongue crosses the teeth",
        "% of the tongue",
        "beyond",
        2.0,
        15.0,
        False,
        "share of the tongue's triangles that cross a triangle of the teeth, but not at rest",
        f"{_HEADS} (9.5 more than the source at most); a share of some hundred triangles is coarse",
    ),
    Measure(
        "lid-gap",
        "eyes stay open after a blink",
        "IRISD",
        "beyond",
        0.01,
        0.05,
        True,
        "opening of the wider eye with FAPs 19 and 20 at 1024, more than the source's",
        "a twentieth of the iris, half a millimetre, shows as a white line",
    ),
    Measure(
        "lids",
        "lids cross the eyeballs",
        "% of the skin",
        "beyond",
        1.0,
        5.0,
        False,
        "share of the triangles before the worse eyeball that cross a triangle of it or lie wholly inside, when it is "
        "made smaller by .02 of its radius, but not at rest, and with no skin before them",
        f"{_HEADS} (3.8 more than the source where a cornea stands out)",
    ),
    Measure(
        "in-eyes",
        "skin inside the eyeballs",
        "% of the skin",
        "beyond",
        0.2,
        1.0,
        False,
        "share of the vertices before the eyeballs that get more than .02 radii deeper into them than at rest, with no "
        "skin before them",
        "some vertices of ten thousand; more is a hole in a lid",
    ),
    Measure(
        "flips",
        "triangles turn over, mean",
        "%",
        "beyond",
        0.05,
        0.3,
        True,
        "moving triangles whose normal turns by more than 90 degrees, mean over all motions",
        "sources have .2 to .6 themselves",
    ),
    Measure(
        "flips-worst",
        "triangles turn over, worst motion",
        "%",
        "limit",
        2.0,
        5.0,
        False,
        "the same in the worst motion",
        "a clone on a coarse mesh loses a handful of triangles in a lip's corner",
    ),
    Measure(
        "fold",
        "skin folds over",
        "eye sep.",
        "beyond",
        0.03,
        0.1,
        False,
        "largest patch of triangles that are seen at rest and turn over together in a motion: the side of the square "
        "that has its area",
        "2 mm; a lip's height, 6 mm, is a hole in the face",
    ),
    Measure(
        "tear",
        "skin tears",
        "times",
        "times",
        1.3,
        2.0,
        False,
        "how abruptly a motion changes along an edge that is seen: difference of the ends' offsets over the edge's "
        "length and 1.2 mm; the tenth-steepest edge",
        f"the source's lids and lip corners are the floor; {_HEADS} (1.6 at most)",
        floor=0.25,
    ),
    Measure(
        "stretch",
        "edges stretch",
        "times",
        "times",
        1.3,
        2.5,
        False,
        "place by place (what is nearest to a feature point, a lip, a lid): the size of log(length after / before) "
        "that nine tenths of the place's edges do not exceed, .3 mm added to both lengths",
        f"a quarter more than the source is not seen; {_HEADS} (2.1 at most)",
        floor=0.1,
    ),
    Measure(
        "bend",
        "skin bends",
        "degrees/mm",
        "times",
        2.0,
        4.0,
        False,
        "place by place: median change of the angle between neighbouring triangles (dihedral angle), over how far they "
        "reach and 1.2 mm",
        f"{_HEADS} (3.1 at most)",
        floor=0.3,
    ),
    Measure(
        "noise",
        "motion is rough",
        "times",
        "times",
        1.5,
        2.5,
        False,
        "what the mean over a vertex's neighbours leaves of its motion, root mean square over all vertices that are "
        "seen; it grows with the square of the edges' length",
        f"{_HEADS} (2.2 at most); noise of a fifth of the motion is beyond",
        floor=0.05,
        finer=2.0,
    ),
    Measure(
        "symmetry",
        "sides differ",
        "relative",
        "limit",
        0.03,
        0.08,
        False,
        "relative difference of a FAP's motion from the mirror image of the other side's; symmetric meshes only",
        "clones on symmetric meshes reach .014",
    ),
    Measure(
        "seams",
        "seams come apart",
        "vertices",
        "limit",
        0.0,
        0.0,
        False,
        "vertices whose copies along a seam a motion takes apart by more than .0001 eye separations",
        "any crack shows",
    ),
    Measure(
        "lining",
        "lining comes through",
        "vertices",
        "limit",
        2.0,
        10.0,
        False,
        "vertices of the lining of mouth, cheeks and nose that come before the skin",
        "a dark spot begins at a handful of vertices",
    ),
    Measure(
        "hidden-stretch",
        "hidden edges stretch",
        "times",
        "limit",
        4.0,
        5.0,
        False,
        "largest length of an edge of hidden skin over its length at rest, .6 mm added to both",
        "the shapes of ICT-FaceKit reach 4.2 for an open jaw, 2.1 for all others",
    ),
)

BY_CODE = {m.code: m for m in MEASURES}
