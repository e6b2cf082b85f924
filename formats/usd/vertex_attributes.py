"""What a scene says of its vertices besides their places: colours and further sets of texture coordinates."""

from __future__ import annotations

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from fba.arrays import Bools, Floats
from fba.errors import InputFileError
from fba.scene import FaceScene
from formats.usd.properties import PREFIX, put_array, to_single, vt
from formats.usd.surfaces import uv_primvar

OWN = "vertex:"
"""Own attributes of a mesh with the exact values, one row after the other; NaN where a vertex has none."""
_TEXCOORD = "texcoord_"


def write_vertex_attributes(mesh: UsdGeom.Mesh, scene: FaceScene, shape: str) -> None:
    """Author them as primvars that every program knows, and exactly."""
    places = scene.file_order()[shape]
    api = UsdGeom.PrimvarsAPI(mesh)
    for name, values in scene.vertex_attributes.items():
        own = values[places]
        known: Bools = np.isfinite(own).min(axis=1, initial=True)
        if not known.any():
            continue
        put_array(mesh.GetPrim(), OWN + name, np.ascontiguousarray(own.ravel(), dtype=np.float64))
        single = to_single(np.where(known[:, None], own, 1.0 if name == "color" else 0.0))
        if name == "color":
            primvar = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
            primvar.Set(vt(single[:, :3]))
        elif name.startswith(_TEXCOORD) and name.removeprefix(_TEXCOORD).isdecimal():
            label = uv_primvar(int(name.removeprefix(_TEXCOORD)))
            kind = Sdf.ValueTypeNames.TexCoord2fArray
            api.CreatePrimvar(label, kind, UsdGeom.Tokens.vertex).Set(vt(single))


def read_vertex_attributes(scene: FaceScene, prims: dict[str, Usd.Prim]) -> dict[str, Floats]:
    """The exact values of all meshes, in the scene's own vertex order.

    prims : name of a shape -> its mesh.
    """
    found: dict[str, Floats] = {}
    places = scene.file_order()
    for shape, prim in prims.items():
        count = len(places[shape])
        for attribute in prim.GetAttributes():
            label = attribute.GetName()
            if not label.startswith(PREFIX + OWN):
                continue
            values = np.array(attribute.Get(), dtype=np.float64).ravel()
            width = values.size // max(count, 1)
            name = label.removeprefix(PREFIX + OWN)
            whole = found.setdefault(name, np.full((scene.vertex_count, width), np.nan))
            if values.size != count * width or whole.shape[1] != width:
                raise InputFileError(f"{prim.GetPath()}: {label} does not fit the {count} vertices")
            whole[places[shape]] = values.reshape(count, width)
    return found
