"""Write no more digits than anybody can see: the shipped file stays small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fat.tables import FaceDefTables
from fba.faps import fap
from fba.fapu import Fapu

ERROR = 1e-7
"""Largest error of a displacement at the last border, in eye separations: six millionths of a millimetre."""


def rounded(tables: FaceDefTables, fapu: Fapu) -> FaceDefTables:
    """The tables with slopes rounded to as many decimals as `ERROR` needs."""
    out = []
    for table in tables:
        unit, meshes = fapu.unit(fap(table.fap_id).unit), []
        for mesh in table.meshes:
            span = float(np.abs(mesh.interval_borders).max()) * unit
            decimals = int(np.ceil(np.log10(0.5 * span / (ERROR * fapu.es0))))
            slopes = np.round(mesh.displacements.astype(np.float64), decimals)
            meshes.append(replace(mesh, displacements=slopes.astype(np.float32)))
        out.append(replace(table, meshes=tuple(meshes)))
    return FaceDefTables(tuple(out))
