"""Wavefront material libraries (.mtl): the part of them that a face's materials carry."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from fba.errors import InputFileError
from fba.mesh import Material
from fba.shading import Shading, TextureMap
from formats.files import read_bytes

_EXPONENT_SCALE = 128.0
"""VRML97's shininess 1 is a specular exponent of 128."""

_MAP_OPTION_VALUES = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-texres": 1, "-type": 1,
    "-bm": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip
"""Options of map_Kd and how many values follow each at most."""


_MAPS = {"norm": ".normal", "map_ke": ".emissive", "map_pr": ".rough_map", "map_pm": ".metal_map"}


def read_mtl(path: Path) -> dict[str, Material]:
    """Read a material library: newmtl, Kd, Ks, Ke, Ns, d, Tr, map_Kd, and of the extension for physically based
    rendering Pr, Pm, norm, map_Ke, map_Pr and map_Pm (both in one image); everything else is skipped.

    Raises
    ------
    InputFileError
        If the file cannot be read. Lines that make no sense are skipped: a material never stops a mesh.
    """
    materials: dict[str, Material] = {}
    fields: dict[str, object] = {}
    name = None
    for line in read_bytes(path, 16 << 20).decode("utf-8", "replace").splitlines():
        keyword, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if keyword == "newmtl":
            if name is not None:
                materials[name] = _material(name, fields)
            name, fields = rest, {}
        elif name is not None:
            fields.update(_field(keyword.lower(), rest))
    if name is not None:
        materials[name] = _material(name, fields)
    return materials


def _material(name: str, fields: dict[str, object]) -> Material:
    """A material of its fields; those of a physically based surface begin with a point."""
    plain = Material(name, **{k: v for k, v in fields.items() if not k.startswith(".")})  # type: ignore[arg-type]
    own = {k[1:]: v for k, v in fields.items() if k.startswith(".")}
    rough, metal = own.pop("rough_map", None), own.pop("metal_map", None)
    if rough is not None and rough == metal:
        own["metallic_roughness"] = rough
    if not own:
        return plain
    own.setdefault("roughness", 1.0 - plain.shininess)
    return replace(plain, shading=Shading(opacity=1.0 - plain.transparency, **own))  # type: ignore[arg-type]


def _field(keyword: str, rest: str) -> dict[str, object]:
    if keyword == "map_kd":
        texture = _texture(rest)
        return {"texture": texture} if texture else {}
    if keyword in _MAPS:
        image = _texture(rest)
        return {_MAPS[keyword]: TextureMap(image)} if image else {}
    try:
        numbers = [float(t) for t in rest.split()]
    except ValueError:
        return {}
    if not numbers or not all(math.isfinite(n) for n in numbers):
        return {}
    colour = tuple((numbers * 3)[:3]) if len(numbers) == 1 else tuple(numbers[:3])
    if keyword in ("kd", "ks", "ke") and len(colour) == 3:
        return {{"kd": "diffuse", "ks": "specular", "ke": "emissive"}[keyword]: colour}
    if keyword == "ns":
        return {"shininess": min(max(numbers[0] / _EXPONENT_SCALE, 0.0), 1.0)}
    if keyword == "d":
        return {"transparency": 1.0 - numbers[0]}
    if keyword == "tr":
        return {"transparency": numbers[0]}
    if keyword in ("pr", "pm"):
        return {{"pr": ".roughness", "pm": ".metallic"}[keyword]: min(max(numbers[0], 0.0), 1.0)}
    return {}


def _texture(rest: str) -> str:
    """The file name behind map_Kd, which may hold blanks; options before it are skipped."""
    words = rest.split(" ")
    while words and words[0].lower() in _MAP_OPTION_VALUES:
        count = _MAP_OPTION_VALUES[words.pop(0).lower()]
        while count and len(words) > 1 and (count == 1 or _is_number(words[0])):
            words.pop(0)
            count -= 1
    return " ".join(words).strip()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def find_materials(folder: Path, libraries: Iterable[str]) -> tuple[dict[str, Material], list[str]]:
    """Read the libraries that lie in `folder`; return the materials and a remark for each one that is not there.

    Only the last part of a library's path is used: nothing outside the mesh's own folder is opened.
    """
    found: dict[str, Material] = {}
    remarks: list[str] = []
    for library in libraries:
        name = library.replace("\\", "/").rsplit("/", 1)[-1]
        try:
            found.update(read_mtl(folder / name))
        except (InputFileError, ValueError):
            remarks.append(f"the material library '{name}' is not in the mesh's folder; colours are defaults")
    return found, remarks


def format_mtl(materials: Iterable[Material]) -> str:
    """Return the text of a library of these materials, in their order."""
    lines: list[str] = []
    for m in materials:
        lines.append(f"newmtl {m.name}")
        for keyword, colour in (("Kd", m.diffuse), ("Ks", m.specular), ("Ke", m.emissive)):
            lines.append(f"{keyword} {' '.join(repr(float(c)) for c in colour)}")
        lines.append(f"Ns {m.shininess * _EXPONENT_SCALE!r}")
        lines.append(f"d {1.0 - m.transparency!r}")
        if m.texture:
            lines.append(f"map_Kd {m.texture}")
        lines += [] if m.shading is None else _shading_lines(m.shading)
    return "\n".join(lines) + "\n"


def _shading_lines(shading: Shading) -> list[str]:
    """What the extension for physically based rendering says of a surface; occlusion has no place in it."""
    lines = [f"Pr {shading.roughness!r}", f"Pm {shading.metallic!r}"]
    if shading.metallic_roughness is not None:
        image = shading.metallic_roughness.image
        lines += [f"map_Pr -imfchan g {image}", f"map_Pm -imfchan b {image}"]
    if shading.normal is not None:
        lines.append(f"norm {shading.normal.image}")
    if shading.emissive is not None:
        lines.append(f"map_Ke {shading.emissive.image}")
    return lines
