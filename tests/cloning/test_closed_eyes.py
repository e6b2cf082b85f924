"""Closed lids leave no slit: what a camera sees of the eyeballs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cloning import clone
from cloning.prepare import PreparedFace, prepare
from cloning.rims import Eye, eyes, rim_follower
from fat import AnimatableFace
from fat.evaluate import Player
from fba import Role
from fba.arrays import Floats
from formats import read_scene
from formats.landmarks import read_landmarks
from samples import default_source
from studio.render import Figure
from studio.render.figure import Style
from studio.render.software import SoftwareRenderer

EYES = (Role.EYE_LEFT, Role.EYE_RIGHT)
CLOSED = ({19: 1024, 20: 1024}, {19: 512, 20: 512, 21: 512, 22: 512}, {19: 624, 20: 624, 21: 400, 22: 400})
HALF = {19: 512, 20: 512}
SLIT = 5e-4
"""Share of the open eye that may show between closed lids: less than a pixel in a portrait."""


class Camera:
    """Close-ups of both eyes from the front; lashes are left out, they would hide a slit."""

    def __init__(self, face: AnimatableFace) -> None:
        self.figure = Figure(face.scene, face.feature_points, Style(occlusion=False, features=False))
        self.roles = [s.role for s in face.scene.shapes]
        self.player = Player(face)
        place = face.feature_points.positions(face.scene)
        self.views = []
        for a, b in (("3.7", "3.11"), ("3.8", "3.12")):
            width = float(np.linalg.norm(place[a] - place[b]))
            middle = tuple(0.5 * (place[a] + place[b]))
            self.views.append(
                replace(self.figure.camera, target=middle, half_height=0.4 * width, half_width=0.6 * width)
            )

    def eyeball(self, faps: dict[int, float]) -> int:
        """Pixels in which some eyeball shows: those that change when eyeballs turn from black to white."""
        shapes = self.player.pose(faps).world_shapes()
        drawn = [(d, r) for d, r in zip(self.figure.drawables(shapes), self.roles, strict=True) if r is not Role.OTHER]
        seen = 0
        for view in self.views:
            pictures = []
            for tone in (0.0, 1.0):
                plain = [self._plain(d, np.full(3, tone if r in EYES else 0.5)) for d, r in drawn]
                pictures.append(SoftwareRenderer().render(plain, view, 360, 240).astype(int))
            seen += int((np.abs(pictures[1] - pictures[0]).max(axis=2) > 12).sum())
        return seen

    @staticmethod
    def _plain(drawable: object, color: Floats) -> object:
        return replace(drawable, color=color, normals=None, gloss=0.0, iris=None, decal=None)  # type: ignore[type-var]


def closes(face: AnimatableFace) -> None:
    camera = Camera(face)
    opened = camera.eyeball({})
    assert opened > 30_000, "the eyes are in the picture"
    assert camera.eyeball(HALF) > 0.3 * opened, "what is open is seen"
    for pose in CLOSED:
        assert camera.eyeball(pose) <= SLIT * opened, pose


def test_source_closes_its_eyes(source: AnimatableFace) -> None:
    closes(source)


@pytest.mark.parametrize("name", ["quad_head", "tri_head"])
def test_clones_close_their_eyes(source: AnimatableFace, name: str) -> None:
    folder = default_source().parent
    scene = read_scene(folder / f"{name}.obj")
    closes(clone(source, scene, read_landmarks(folder / f"{name}.fps.json", scene), faps=(19, 20, 21, 22)))


def test_ict_facekit_closes_its_eyes(shared: Path, source: AnimatableFace) -> None:
    scene = read_scene(shared / "faces" / "ict-facekit" / "generic_neutral_mesh.obj")
    points = read_landmarks(shared / "landmarks" / "ict.json", scene)
    closes(clone(source, scene, points, faps=(19, 20, 21, 22)))


def test_a_rim_follows_and_its_feature_points_stay(source: AnimatableFace) -> None:
    face = prepare(source.scene, source.feature_points, "source")
    for eye in eyes(face):
        assert eye is not None
        for part, keys in enumerate((("3.1", "3.2"), ("3.3", "3.4"))):
            lid, still = eye.lids[part], np.zeros_like(face.skin.vertices)
            wanted = np.full(len(eye.open), 0.1)
            lifted = still.copy()
            lifted[lid.vertices, 1] = eye.follow(part, still, wanted, 0.0)
            points = face.skin.point_matrix(keys) @ lifted
            assert np.abs(points).max() < 1e-4 * eye.opening.max()
            away = np.abs(np.linspace(-1.0, 1.0, len(wanted) + 2)[1:-1]) > 0.25
            reached = eye.travel(part, lifted)[eye.open & away]
            assert np.abs(reached - 0.1).mean() < 0.02
            assert not eye.travel(part, still).any()


def test_rims_move_only_where_lids_stay_open(source: AnimatableFace) -> None:
    face = prepare(source.scene, source.feature_points, "source")
    follower = rim_follower(face, face)
    for eye in follower.yours:
        assert eye is not None
        overlapping = lowered(face, eye, 1.3)
        for share, corrected in ((1.12, False), (0.8, True)):
            before = lowered(face, eye, share)
            after = before.copy()
            follower.apply(overlapping, after)
            assert np.any(after != before) == corrected, share
        pressed, after = lowered(face, eye, 0.1), 0.0 * overlapping
        follower.apply(pressed, after)
        assert not after.any(), "a lid that comes down a little closes nothing"


def lowered(face: PreparedFace, eye: Eye, share: float) -> Floats:
    """An upper lid that goes down by a share of the opening, (n, 1, 3) in mesh units."""
    lid = eye.lids[0]
    row = np.flatnonzero(eye.open)
    motion = np.zeros((face.skin.vertex_count, 1, 3))
    motion[lid.vertices, 0, 1] = -share * np.interp(lid.rest[:, 0], lid.span[row], eye.opening[row]) * face.fapu.es0
    return motion
