"""File formats. `read` and `write` choose by the file's extension."""

from __future__ import annotations

from formats.registry import (
    Format,
    FormatModule,
    format_of,
    formats,
    read,
    read_face,
    read_scene,
    register,
    write,
)

register(Format("Wavefront OBJ", (".obj",), "formats.obj", names_images=True))
register(Format("PLY", (".ply",), "formats.ply"))
register(Format("STL", (".stl",), "formats.stl"))
register(Format("OFF", (".off",), "formats.off"))
register(Format("Candide-3", (".wfm",), "formats.wfm", writes=False))
register(Format("glTF 2.0", (".gltf", ".glb"), "formats.gltf", carries_tables=True, carries_streams=True))
register(
    Format(
        "VRML97",
        (".wrl", ".wrz", ".wrl.gz", ".vrml"),
        "formats.vrml97",
        carries_tables=True,
        names_images=True,
        portable=True,
    )
)
register(
    Format(
        "X3D",
        (".x3d", ".x3dz", ".x3d.gz"),
        "formats.x3d",
        carries_tables=True,
        names_images=True,
        carries_streams=True,
        portable=True,
    )
)
register(
    Format("MPEG-4 BT", (".bt", ".bt.gz"), "formats.bt", carries_tables=True, names_images=True, carries_streams=True)
)
register(
    Format(
        "MPEG-4 XMT-A",
        (".xmt", ".xmta", ".xmt.gz", ".xmta.gz"),
        "formats.xmta",
        carries_tables=True,
        names_images=True,
        carries_streams=True,
    )
)
register(
    Format(
        "USD",
        (".usda", ".usdc", ".usd"),
        "formats.usd",
        carries_tables=True,
        names_images=True,
        carries_streams=True,
        portable=True,
    )
)
register(Format("USDZ", (".usdz",), "formats.usd", carries_tables=True, carries_streams=True, portable=True))

__all__ = [
    "Format",
    "FormatModule",
    "format_of",
    "formats",
    "read",
    "read_face",
    "read_scene",
    "register",
    "write",
]
