"""Where the parts of a face are, by rules of thumb alone: the first correspondence of Expression Cloning.

Noh and Neumann find a first set of points by heuristic rules on a face that looks along z: the nose is what sticks out
most, the mouth lies between two bulges below it, and so on. The rules here go by the outline of the middle of the face
and by level cuts. They know no feature points; lengths are in eye separations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cloning.detect.slices import Slice, Slicer, deepest
from cloning.surface import Surface
from fba.arrays import Floats

HEAD = 4.5
"""A head is at most this high."""

FACE = (1.2, 3.4)
"""The tip of the nose lies this far below the top of the head."""

STEP = 0.01
"""Distance of the heights (or sides) at which an outline is looked at."""

BULGE = 0.004
"""What sticks out less is no lip and no chin."""

SLIT = 0.06
"""Openings of the outline up to this high are closed: lips that do not meet."""

FOLD = 0.08
"""A corner of the mouth is where a level cut lies farthest behind the skin this far to both sides of it."""

REACH = 0.7
"""Half the width in which wings of the nose, corners of the mouth and of the eyes are sought."""


def rule_points(skin: Surface) -> dict[str, Floats]:
    """Points of a face by rules; what no rule finds is left out.

    Returns
    -------
    name -> (3,); names are the same on every face.
    """
    top = skin.vertices[np.argmax(skin.vertices[:, 1])]
    head = skin.vertices[skin.vertices[:, 1] > top[1] - HEAD]
    below = top[1] - head[:, 1]
    front = head[(below > FACE[0]) & (below < FACE[1])]
    if not len(front):
        return {}
    tip = front[np.argmax(front[:, 2])]
    found = {"top": top, "nose tip": tip}
    low, high = tip - np.array([2.0, HEAD, HEAD]), tip + np.array([2.0, HEAD, 1.0])
    middle = Slicer(skin, low, high).at(float(tip[0]))
    found |= _outline(middle, tip)
    level = Slicer(skin, low, high, axis=1)
    found |= _sides(head, tip)
    found |= _pair("nose wing", _cuts(level, tip), tip, deepest)
    for name, of, rule in (("mouth corner", "mouth", _fold), ("eye corner", "nose bridge", deepest)):
        if of in found:
            found |= _pair(name, _cuts(level, found[of]), found[of], rule)
    return found


def _outline(cut: Slice, tip: Floats) -> dict[str, Floats]:
    """Bridge and forehead above the tip of the nose; lips and chin below, by the bulges of the outline."""
    x = float(tip[0])
    found: dict[str, Floats] = {}
    up = tip[1] + np.arange(0.0, 1.2, STEP)
    depths = cut.profile(up)
    if np.isfinite(depths).all():
        bridge, _ = deepest(up, depths)
        found["nose bridge"] = np.array([x, up[bridge], depths[bridge]])
    down = tip[1] - np.arange(0.0, 1.9, STEP)
    depths = _closed(cut.profile(down))
    known = int(np.argmin(np.isfinite(depths))) if not np.isfinite(depths).all() else len(depths)
    names = ("nose base", "upper lip", "mouth", "lower lip")
    turns = _turns(depths[:known])
    if len(turns) < len(names):
        return found
    last = turns[len(names) - 1]
    # Below the chin the outline runs back: the chin is what lies farthest forward and down alike.
    chin = last + int(np.argmax(depths[last:known] - down[last:known]))
    cleft = last + deepest(down[last : chin + 1], depths[last : chin + 1])[0] if chin > last + 1 else last
    for name, k in zip((*names, "chin cleft", "chin"), (*turns[: len(names)], cleft, chin), strict=True):
        found[name] = np.array([x, down[k], depths[k]])
    return found


def _turns(depths: Floats) -> list[int]:
    """Where an outline that starts at the tip of the nose turns: backwards end, forwards end, and so on."""
    turns: list[int] = []
    best, outward = 0, False
    for k, depth in enumerate(depths):
        ahead = depth - depths[best]
        if ahead == 0.0 or bool(ahead > 0.0) == outward:
            best = k
        elif abs(ahead) > BULGE:
            turns.append(best)
            best, outward = k, not outward
    return turns


def _sides(head: Floats, tip: Floats) -> dict[str, Floats]:
    """The outermost skin to both sides at the height of the nose."""
    band = head[np.abs(head[:, 1] - tip[1]) < 0.4]
    return {"left side": band[np.argmax(band[:, 0])], "right side": band[np.argmin(band[:, 0])]}


def _pair(
    name: str, cuts: Sequence[Slice], middle: Floats, rule: Callable[[Floats, Floats], tuple[int, float]]
) -> dict[str, Floats]:
    """Where a rule finds something on level cuts, the foremost of them, to the left and right of their middle."""
    found: dict[str, Floats] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        along = np.arange(0.0, REACH, STEP)
        depths = _closed(np.fmax.reduce([cut.profile(middle[0] + sign * along) for cut in cuts]))
        if np.isfinite(depths).all():
            k, _ = rule(along, depths)
            found[f"{side} {name}"] = np.array([middle[0] + sign * along[k], middle[1], depths[k]])
    return found


def _cuts(level: Slicer, middle: Floats) -> list[Slice]:
    """Level cuts through a place and beside it, so that none runs into the slit between open lips."""
    return [level.at(float(middle[1]) + aside) for aside in (-0.5 * SLIT, 0.0, 0.5 * SLIT)]


def _fold(along: Floats, depths: Floats) -> tuple[int, float]:
    """Where a curve lies farthest behind the middle of its places a little to both sides, and how far."""
    n = round(FOLD / STEP)
    behind = 0.5 * (depths[2 * n :] + depths[: -2 * n]) - depths[n:-n]
    k = int(np.argmax(behind))
    return k + n, float(behind[k])


def _closed(depths: Floats) -> Floats:
    """An outline without its narrow slits: nan where they are wider than `SLIT`."""
    from scipy.ndimage import grey_closing

    n = round(SLIT / STEP)
    wide = np.pad(np.where(np.isfinite(depths), depths, -1e9), n, mode="edge")
    closed = grey_closing(wide, (n,))[n:-n]
    return np.where(closed > -1e8, closed, np.nan)
