"""Facial animation parameter units (FAPUs): the distances on the neutral face that FAP values are measured in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fba.arrays import Floats
from fba.errors import LandmarkError
from fba.faps import Unit
from fba.feature_points import feature_point_definitions

FAPU_DIVISOR = 1024.0
ANGLE_UNIT = 1e-5
"""One AU in radians."""

FAPU_POINTS = ("3.1", "3.2", "3.3", "3.4", "3.5", "3.6", "9.15", "2.2", "8.3", "8.4")


@dataclass(frozen=True, slots=True)
class Fapu:
    """The five distances of the neutral face, in units of the mesh (ISO/IEC 14496-2, FAPU table).

    irisd0 : iris diameter, 3.1.y - 3.3.y, mean of both eyes.
    es0 : eye separation, 3.5.x - 3.6.x.
    ens0 : eye to nose, mean eye height - 9.15.y.
    mns0 : mouth to nose, 9.15.y - 2.2.y.
    mw0 : mouth width, 8.3.x - 8.4.x.
    """

    irisd0: float
    es0: float
    ens0: float
    mns0: float
    mw0: float

    def base(self, unit: Unit) -> float:
        """The whole distance (IRISD0 ...) behind a unit; 1 for units that have none."""
        return {
            Unit.IRISD: self.irisd0,
            Unit.ES: self.es0,
            Unit.ENS: self.ens0,
            Unit.MNS: self.mns0,
            Unit.MW: self.mw0,
        }.get(unit, 1.0)

    def unit(self, unit: Unit) -> float:
        """What one FAP unit is: distance/1024 in mesh units, 1e-5 rad for AU, 1 for FAP 1 and 2."""
        if unit is Unit.AU:
            return ANGLE_UNIT
        if unit is Unit.NONE:
            return 1.0
        return self.base(unit) / FAPU_DIVISOR

    @classmethod
    def from_feature_points(cls, positions: Mapping[str, Floats]) -> Fapu:
        """Measure the FAPUs of a face.

        Parameters
        ----------
        positions : feature point id -> (3,) in inside axes (+X subject's left, +Y up).

        Raises
        ------
        LandmarkError
            If a point is missing, or a distance comes out zero or negative (points swapped left/right or
            up/down, or the face turned).
        """
        missing = [i for i in FAPU_POINTS if i not in positions]
        if missing:
            names = ", ".join(f"{i} ({feature_point_definitions()[i].definition})" for i in missing)
            raise LandmarkError(f"the FAPUs need feature points that are not given: {names}")
        p = positions
        irisd0 = 0.5 * float((p["3.1"][1] - p["3.3"][1]) + (p["3.2"][1] - p["3.4"][1]))
        es0 = float(p["3.5"][0] - p["3.6"][0])
        ens0 = 0.5 * float(p["3.5"][1] + p["3.6"][1]) - float(p["9.15"][1])
        mns0 = float(p["9.15"][1] - p["2.2"][1])
        mw0 = float(p["8.3"][0] - p["8.4"][0])
        rows = (
            ("IRISD0", irisd0, "3.1/3.3 and 3.2/3.4 (upper lid above lower lid)"),
            ("ES0", es0, "3.5 and 3.6 (left pupil at larger x than right)"),
            ("ENS0", ens0, "3.5/3.6 and 9.15 (eyes above the base of the nose)"),
            ("MNS0", mns0, "9.15 and 2.2 (nose above the upper lip)"),
            ("MW0", mw0, "8.3 and 8.4 (left lip corner at larger x than right)"),
        )
        for name, value, who in rows:
            if not value > 0.0:
                raise LandmarkError(
                    f"{name} is {value:.4g}, but must be positive: check the feature points {who}; "
                    "left means the subject's left"
                )
        return cls(irisd0, es0, ens0, mns0, mw0)
