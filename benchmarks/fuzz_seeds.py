"""Small good files of every kind that is read: where fuzzing starts."""

from __future__ import annotations

import base64
import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from fat import AnimatableFace, FaceDefMesh, FaceDefTable, FaceDefTables, FaceDefTransform
from fba import FaceScene, FapStream, Fapu, FeaturePoint, FeaturePoints, Transform
from formats import read_scene, write
from formats.arkit_csv import format_arkit_csv
from formats.fap import read_fap, write_fap
from formats.fba_bitstream import encode_fba
from samples import sample

OBJ = b"""mtllib x.mtl
o skin
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
vn 0 0 1
g front
usemtl red
f 1/1 3/3 2/2
f 1/1/1 2/2/1 4/3/1 \\
 3/3/1
s 1
f 2 3 4 # a comment
f -4//1 -1//1 -2//1
"""

MTL = b"newmtl red\nKd 1 0 0\nKs .5\nNs 20\nd 0.5\nTr 0.1\nmap_Kd -s 1 1 -clamp on face one.png\nnewmtl b\nKe 1 1 1\n"

WFM = b"""# VERTEX LIST:
3
0 0 0
1 0 0
0 1 .5
# FACE LIST:
1
0 1 2
# ANIMATION UNITS LIST:
1
# Jaw (AU26/27)
1
1 0.1 -0.2 0.3
"""

VRML = b"""#VRML V2.0 utf8
PROTO Head [ field SFFloat x 1.5 exposedField MFNode parts [] eventIn SFBool go ] { Group { children IS parts } }
EXTERNPROTO Eye [ field SFColor c ] [ "eye.wrl" "urn:eye" ]
WorldInfo { title "a \\"head\\"" info [ "one", "two" ] }
NavigationInfo { headlight TRUE type [ "EXAMINE" ] }
DEF T Transform { translation 1 -2.5e-3 .5 rotation 0 1 0 0x10 scale 1 2 1 scaleOrientation 1 0 0 +.1 center 0 0 0
  children [
    DEF S Shape {
      appearance Appearance {
        material DEF M Material { diffuseColor 0.8 0.6 0.5 transparency .2 shininess 0.4 }
        texture ImageTexture { url "face.png" repeatS FALSE }
      }
      geometry IndexedFaceSet {
        coord DEF C Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0, .5 .5 1 ] }
        coordIndex [ 0, 1, 2, 3, -1, 0, 4, 1, -1 4 3 0 ]
        texCoord TextureCoordinate { point [ 0 0, 1 0, 1 1 ] } texCoordIndex [ 0 1 2 0 -1 2 1 0 -1 0 1 2 -1 ]
        normal Normal { vector [ 0 0 1 0 1 0 1 0 0 ] } normalIndex [ 0 1 2 ] normalPerVertex FALSE
        color Color { color [ 1 0 0, 0 1 0 ] } colorIndex [ 0 1 0 ] colorPerVertex FALSE
        creaseAngle 1.0 ccw FALSE solid FALSE convex TRUE
      }
    }
    Switch { whichChoice 0 choice [ USE S Shape { geometry Sphere { } } ] }
    LOD { range [ 10 ] level [ USE S Group { } ] }
    Billboard { children Shape { appearance Appearance { material USE M } geometry NULL } }
    Inline { url [ "other.wrl" ] }
  ]
}
DEF W Script { url "javascript: function f(v) { }" eventOut SFVec3f out field SFNode t USE T directOutput TRUE }
ROUTE W.out TO T.set_translation # the end
"""

USDA = b"""#usda 1.0
(
    defaultPrim = "Root"
    metersPerUnit = 0.01
    upAxis = "Z"
)
def SkelRoot "Root"
{
    def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"])
    {
        int[] faceVertexCounts = [4, 3]
        int[] faceVertexIndices = [0, 1, 2, 3, 0, 4, 1]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (1, 0), (1, 1)] (
            interpolation = "faceVarying"
        )
        uniform token[] skel:blendShapes = ["smile"]
        rel skel:blendShapeTargets = </Root/skin/smile>
        double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def BlendShape "smile"
        {
            uniform vector3f[] offsets = [(0, 0.1, 0), (0.2, 0, 0)]
            uniform int[] pointIndices = [1, 4]
        }
    }
}
"""

_CUE = b'{"start": 0.1, "end": 0.3, "value": "D"}'
CUES = (
    b"0.00\tX\n0.05\tD\n0.27\tC\n0.47\tX\n",
    b'{"mouthCues": [' + _CUE + b", " + _CUE.replace(b"D", b"A") + b"]}",
)

_WRITTEN = {
    "bt": (".bt",),
    "glb": (".glb",),
    "gltf": (".glb",),
    "obj": (".obj",),
    "off": (".off",),
    "ply": (".ply",),
    "stl": (".stl",),
    "usda": (".usda",),
    "wrl": (".wrl", ".wrl.gz"),
    "x3d": (".x3d",),
    "xmt": (".xmt",),
}
"""Kind -> endings under which the small face is written."""

_BY_HAND = {"obj": OBJ, "mtl": MTL, "wfm": WFM, "wrl": VRML, "bt": VRML, "usda": USDA}


def scene_seeds(kind: str) -> list[bytes]:
    """Good files of one kind of scene: one by hand, and what our own writer makes of a small face."""
    from formats import formats

    known = {e: f for f in formats() if f.writes for e in f.extensions}
    moving = FapStream.build(25, 3, {3: [0, 90, 0], 49: [0, 20000, -500]}, visemes=[[1, 2, 63, 0], [0] * 4, [0] * 4])
    out = [_BY_HAND[kind]] if kind in _BY_HAND else []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        face = small_face(folder)
        for ending in _WRITTEN.get(kind, ()):
            if ending in known:
                path = folder / f"x{ending}"
                for stream in (None, moving) if known[ending].carries_streams else (None,):
                    write(face, path, stream)
                    out.append(path.read_bytes())
    return [_with_inline_buffer(data) for data in out] if kind == "gltf" else out


def small_face(folder: Path) -> AnimatableFace:
    """A tetrahedron below a transform, with the tables of two FAPs and a viseme."""
    path = folder / "first.obj"
    path.write_bytes(OBJ)
    scene = read_scene(path)
    skin = scene.shapes[0].name
    scene = FaceScene((Transform("head", scene.roots, translation=(0.0, 1.0, 0.0)),), scene.frame, 0.1, "small")
    slopes = np.full((2, 2, 3), 0.25, dtype=np.float32)
    moved = FaceDefMesh(skin, np.array([0, 400, 1080]), np.array([0, 2]), slopes)
    tables = (
        FaceDefTable(3, 1, (moved,)),
        FaceDefTable(1, 1, (replace(moved, interval_borders=np.array([0, 30, 63])),)),
        FaceDefTable(49, 1, (), (FaceDefTransform("head", rotation_def=(0.0, 1.0, 0.0, 1.0)),)),
    )
    points = FeaturePoints({"2.1": FeaturePoint(skin, (0, 1), (0.25, 0.75))})
    return AnimatableFace(scene, points, FaceDefTables(tables), Fapu(0.2, 0.8, 0.7, 0.3, 0.9))


def _with_inline_buffer(data: bytes) -> bytes:
    """A .glb as a .gltf that holds its buffer as text, so that a mutation leaves the container whole."""
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(data[28 + length :]).decode()
    )
    return json.dumps(document).encode()


def stream_seeds(kind: str) -> list[bytes]:
    """Good files of one kind of stream."""
    demo = read_fap(sample("streams/demo.fap"))[0]
    short = FapStream(
        25,
        demo.values[40:46],
        demo.mask[40:46],
        demo.visemes[50:56],
        demo.expressions[50:56],
        np.array([0, 1, 2, 20, 21, 40]),
    )
    plain = FapStream.build(30, 3, {3: [0, 90, 0], 19: [0, 1024, 0], 49: [0, 20000, -500]})
    if kind == "fba":
        return [encode_fba(s, q)[0] for s in (short, plain) for q in (None, 0, 1, 9)]
    if kind == "csv":
        return [format_arkit_csv(s)[0].encode() for s in (short, plain)]
    if kind == "cues":
        return list(CUES)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.fap"
        out = []
        for stream in (short, plain):
            write_fap(stream, path)
            out.append(path.read_bytes())
        return out
