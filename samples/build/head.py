"""One MakeHuman head: its neutral scene, feature points, and the offsets of any target on it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Floats
from fba.fapu import Fapu
from fba.feature_points import NECK_BASE, FeaturePoint, FeaturePoints
from fba.mesh import Material
from fba.scene import FaceScene, Role, Shape
from fba.sphere import fit_sphere
from samples.build.crop import PARTS, HeadCrop, crop_head
from samples.build.eyeball import eyeball
from samples.build.fairing import Fairing
from samples.build.makehuman import MakeHuman

POINTS_FILE = Path(__file__).with_name("makehuman_points.json")
"""Feature points on the base mesh: face = three base vertices, bary = their weights."""

RACES = {"caucasian": 0.35, "asian": 0.35, "african": 0.3}
SEXES = {"female": 0.6, "male": 0.4}

EYES = (("eye_left", Role.EYE_LEFT, "helper-l-eye", "3.5"), ("eye_right", Role.EYE_RIGHT, "helper-r-eye", "3.6"))

_SKIN = (
    Material("skin", (0.87, 0.69, 0.59), specular=(0.06, 0.06, 0.06), shininess=0.2),
    Material("lip", (0.80, 0.54, 0.49), specular=(0.06, 0.06, 0.06), shininess=0.2),
    Material("mouth", (0.50, 0.22, 0.21), specular=(0.06, 0.06, 0.06), shininess=0.2),
)
_LASH = Material("lash", (0.16, 0.11, 0.09))
_TOOTH = Material("tooth", (0.92, 0.89, 0.80), specular=(0.3, 0.3, 0.3), shininess=0.6)
_EYE = (
    Material("sclera", (0.93, 0.92, 0.90), specular=(0.4, 0.4, 0.4), shininess=0.8),
    Material("iris", (0.25, 0.36, 0.42), specular=(0.4, 0.4, 0.4), shininess=0.8),
    Material("pupil", (0.02, 0.02, 0.03), specular=(0.5, 0.5, 0.5), shininess=0.8),
)
MATERIALS: dict[str, tuple[Material, ...]] = {
    "skin": _SKIN,
    "eye_left": _EYE,
    "eye_right": _EYE,
    "upper_teeth": (_TOOTH,),
    "lower_teeth": (_TOOTH,),
    "tongue": (Material("tongue", (0.72, 0.34, 0.34), specular=(0.2, 0.2, 0.2), shininess=0.4),),
    "lashes_left": (_LASH,),
    "lashes_right": (_LASH,),
}


@dataclass(frozen=True)
class Head:
    """A head of one phenotype.

    body : (19158, 3) vertices of the whole MakeHuman body, decimetres.
    local : shape name -> (n, 3) corrections on top (lips closed ...), absent = none.
    placed : feature points that were placed anew on this head.
    fairing : smooths the units of the skin; None = as they are.
    eye_segments : of the eyeballs' rings.
    """

    makehuman: MakeHuman
    crop: HeadCrop
    body: Floats
    name: str
    local: dict[str, Floats] = field(default_factory=dict)
    placed: dict[str, FeaturePoint] = field(default_factory=dict)
    fairing: Fairing | None = None
    eye_segments: int = 24

    @cached_property
    def parts(self) -> dict[str, Floats]:
        """Vertices of every cropped shape (without eyeballs)."""
        cut = self.crop.cut(self.body)
        return {name: values + self.local.get(name, 0.0) for name, values in cut.items()}

    @cached_property
    def eye_centers(self) -> dict[str, tuple[Floats, float]]:
        """Shape name -> centre (3,) and radius of MakeHuman's eyeball (least-squares sphere)."""
        groups = self.makehuman.base.groups
        found = {}
        for shape, _, group, _ in EYES:
            ball = self.body[np.unique(self.makehuman.base.quads[groups[group]])]
            center, radius, _ = fit_sphere(ball)
            found[shape] = (center, radius)
        return found

    @cached_property
    def surface_points(self) -> dict[str, Floats]:
        """Positions of all feature points on the cropped shapes."""
        out = {k: np.asarray(q.weights) @ self.parts["skin"][list(q.vertices)] for k, q in self.placed.items()}
        for key, row in _point_rows().items():
            if key in out:
                continue
            if "face" in row and int(row["face"][0]) in self.crop.places:
                places = [self.crop.places[int(v)] for v in row["face"]]
                corners = np.array([self.parts[shape][k] for shape, k in places])
                out[key] = np.asarray(row["bary"]) @ corners
        return out

    @cached_property
    def iris_radius(self) -> float:
        """Half the lid opening: MPEG-4's neutral lids are tangent to the iris."""
        p = self.surface_points
        return 0.25 * float(p["3.1"][1] - p["3.3"][1] + p["3.2"][1] - p["3.4"][1])

    @cached_property
    def scene(self) -> FaceScene:
        """Skin, eyeballs, teeth, tongue, lashes; quads, but for the poles of the eyeballs."""
        shapes = []
        for name, role, _ in PARTS:
            mesh = self.crop.shapes[name].mesh.with_vertices(self.parts[name])
            shapes.append(Shape(name, mesh, role, MATERIALS[name]))
        eyes = []
        for name, role, _, _ in EYES:
            center, radius = self.eye_centers[name]
            eyes.append(
                Shape(name, eyeball(center, radius, self.iris_radius, self.eye_segments), role, MATERIALS[name])
            )
        return FaceScene((shapes[0], *eyes, *shapes[1:]), meters_per_unit=0.1, name=self.name)

    @cached_property
    def points(self) -> FeaturePoints:
        """The 82 points of `makehuman_points.json` plus 7.1 and 7.2.

        7.1 (top of the spine) is the middle between the ear lobes' contact points 10.7 and 10.8; 7.2 (base of
        the neck) is MakeHuman's joint "neck". Both are free points.
        """
        found = {}
        for key, row in _point_rows().items():
            if key in self.surface_points and key not in self.placed:
                places = [self.crop.places[int(v)] for v in row["face"]]
                kept = [(k, float(w)) for (_, k), w in zip(places, row["bary"], strict=True) if w > 0.0]
                found[key] = FeaturePoint(places[0][0], tuple(k for k, _ in kept), tuple(w for _, w in kept))
        for name, _, _, key in EYES:
            found[key] = FeaturePoint(name, (0,), (1.0,))
        p = self.surface_points
        found["7.1"] = FeaturePoint.free(0.5 * (p["10.7"] + p["10.8"]), "derived")
        neck = self.makehuman.base.joint("neck", self.body)
        found[NECK_BASE] = FeaturePoint.free(neck, "derived")
        return FeaturePoints({**found, **self.placed})

    @cached_property
    def positions(self) -> dict[str, Floats]:
        return self.points.positions(self.scene)

    @cached_property
    def fapu(self) -> Fapu:
        return Fapu.from_feature_points(self.positions)

    def unit(self, name: str) -> dict[str, Floats]:
        """Offsets of one ARKit face unit at weight 1: shape -> (n, 3); the eyeballs stay."""
        offsets = self.crop.cut(self.makehuman.target("faceunits", name))
        if self.fairing is not None:
            offsets["skin"] = self.fairing.smooth(offsets["skin"])
        for shape, _, _, _ in EYES:
            offsets[shape] = np.zeros((self.scene.shape(shape).mesh.vertex_count, 3))
        return offsets

    def moved(self, local: dict[str, Floats]) -> Head:
        """The same head with more local corrections."""
        joined = {name: self.local.get(name, 0.0) + local.get(name, 0.0) for name in {**self.local, **local}}
        return replace(self, local={k: np.asarray(v) for k, v in joined.items()})


def build_head(makehuman: MakeHuman, mixture: dict[tuple[str, str], float], name: str) -> Head:
    """Build a head from MakeHuman targets.

    Parameters
    ----------
    mixture : (kind, target) -> weight, e.g. ``{("macrodetails", "asian-male-young"): 1.0}``.
    """
    body = makehuman.base.vertices.copy()
    for (kind, target), weight in mixture.items():
        body += weight * makehuman.target(kind, target)
    return Head(makehuman, crop_head(makehuman.base), body, name)


def macro(race: str, sex: str, age: str, weight: float) -> dict[tuple[str, str], float]:
    """The two targets of one phenotype: of race, and of sex and age with average muscle and weight."""
    return {
        ("macrodetails", f"{race}-{sex}-{age}"): weight,
        ("macrodetails", f"universal-{sex}-{age}-averagemuscle-averageweight"): weight,
    }


def mean_mixture() -> dict[tuple[str, str], float]:
    """A young face between all races and both sexes."""
    mixture: dict[tuple[str, str], float] = {}
    for race, share in RACES.items():
        for sex, part in SEXES.items():
            for key, weight in macro(race, sex, "young", share * part).items():
                mixture[key] = mixture.get(key, 0.0) + weight
    return mixture


def _point_rows() -> dict[str, dict[str, list[float]]]:
    rows: dict[str, dict[str, list[float]]] = json.loads(POINTS_FILE.read_text("utf-8"))
    return rows
