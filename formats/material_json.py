"""A material as JSON, exactly, for the parts of files that only this toolkit reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from math import isfinite
from typing import Any

from fba.mesh import Material
from fba.shading import ALPHA_MODES, MAGNIFY, MINIFY, WRAPS, Shading, TextureMap

_MAPS = ("base", "metallic_roughness", "normal", "occlusion", "emissive")


def material_json(material: Material) -> dict[str, Any]:
    """All fields of a material; "shading" only where it has one."""
    row = asdict(material)
    if material.shading is None:
        del row["shading"]
    return row


def read_material(row: Mapping[str, Any]) -> Material:
    """The material of `material_json`.

    Raises
    ------
    KeyError, TypeError, ValueError
        If a field is missing or of another kind.
    """
    texture, shading = row["texture"], row.get("shading")
    return Material(
        _text(row["name"]),
        diffuse=_numbers(row["diffuse"], 3),
        ambient_intensity=_number(row["ambient_intensity"]),
        specular=_numbers(row["specular"], 3),
        emissive=_numbers(row["emissive"], 3),
        shininess=_number(row["shininess"]),
        transparency=_number(row["transparency"]),
        texture=None if texture is None else _text(texture),
        shading=None if shading is None else _shading(shading),
    )


def _shading(row: Mapping[str, Any]) -> Shading:
    values: dict[str, Any] = {}
    plain = Shading()
    for entry in fields(Shading):
        value, default = row[entry.name], getattr(plain, entry.name)
        if entry.name in _MAPS:
            values[entry.name] = None if value is None else _map(value)
        elif entry.name == "alpha_mode":
            values[entry.name] = _one_of(value, ("", *ALPHA_MODES))
        elif isinstance(default, bool):
            values[entry.name] = bool(value)
        else:
            values[entry.name] = _number(value)
    return Shading(**values)


def _map(row: Mapping[str, Any]) -> TextureMap:
    texcoord = row["texcoord"]
    if type(texcoord) is not int or texcoord < 0:
        raise ValueError("a set of texture coordinates has a number from 0")
    along_u, along_v = row["wrap"]
    return TextureMap(
        _text(row["image"]),
        texcoord,
        (_one_of(along_u, WRAPS), _one_of(along_v, WRAPS)),
        _one_of(row["magnify"], ("", *MAGNIFY)),
        _one_of(row["minify"], ("", *MINIFY)),
        _numbers(row["offset"], 2),
        _number(row["rotation"]),
        _numbers(row["scale"], 2),
    )


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("a name must be text")
    return value


def _one_of(value: object, allowed: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"'{str(value)[:40]}' is none of {', '.join(filter(None, allowed))}")
    return value


def _number(value: Any) -> float:
    number = float(value)
    if not isfinite(number):
        raise ValueError("a number must be finite")
    return number


def _numbers(values: Any, count: int) -> Any:
    if len(values) != count:
        raise ValueError(f"{count} numbers are needed, not {len(values)}")
    return tuple(_number(value) for value in values)
