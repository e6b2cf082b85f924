"""Morph targets of a face: read from OBJ folders, .npz, glTF and USD, written as OBJ folders and .npz.

Everything is in the file's own axes, units and vertex order.
"""

from __future__ import annotations

import gzip
import io
import shutil
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fba.arrays import Floats
from fba.errors import InputFileError, MeshError, OutputFileError, UnknownFormatError
from fba.scene import FaceScene
from fba.shapes import ShapeSet
from formats import gltf, obj
from formats.files import read_bytes
from formats.npz import read_npz, write_npz
from formats.text_lines import TextLines
from formats.wfm import read_animation_units

_NEUTRAL_NAMES = ("neutral", "basis", "base")


def read_shapes(path: Path, neutral: FaceScene) -> ShapeSet:
    """Read the morph targets of a face.

    Parameters
    ----------
    path : a folder of OBJ files (or MakeHuman .target files), one for each target, named after it; an .npz with
        names (K,), deltas (K, N, 3) and optionally neutral (N, 3); a .glb or .gltf with morph targets; a .usda,
        .usdc, .usd or .usdz with blend shapes; a .wfm with Candide-3's animation units.
    neutral : the face that they belong to, N vertices.

    Raises
    ------
    InputFileError
        If something cannot be read, or no target is found.
    MeshError
        If the number of vertices differs from the neutral face's; the message names the file.
    """
    path = Path(path)
    base = neutral.frame.to_file(neutral.world_neutral())
    name = path.name.lower()
    if path.is_dir():
        found = _read_folder(path, neutral, base)
    elif name.endswith(".npz"):
        found = _read_archive(path, len(base))
    elif name.endswith((".glb", ".gltf")):
        found = _read_gltf(path, len(base))
    elif name.endswith((".usda", ".usdc", ".usd", ".usdz")):
        found = _read_usd(path, len(base))
    elif name.endswith(".wfm"):
        found = read_animation_units(path, len(base))
    elif not path.exists():
        raise InputFileError(f"{path} does not exist; check the path")
    else:
        raise UnknownFormatError(f"{path}: morph targets come as a folder of OBJ files, .npz, glTF, USD or .wfm")
    if not found:
        raise InputFileError(f"{path} holds no morph targets")
    deltas = np.empty((len(found), len(base), 3))
    for k, (_, offsets) in enumerate(found):
        deltas[k] = offsets
    try:
        return ShapeSet(tuple(n for n, _ in found), base, deltas)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


_Targets = list[tuple[str, Floats]]


def _check_count(path: Path, count: int, wanted: int) -> None:
    if count != wanted:
        raise MeshError(
            f"{path} has {count} vertices, but the neutral face has {wanted}: morph targets must keep the neutral "
            "face's vertices and their order"
        )


def _read_folder(path: Path, neutral: FaceScene, base: Floats) -> _Targets:
    found: _Targets = []
    for file in sorted(path.iterdir()):
        name = file.name.lower()
        if name.endswith(".obj"):
            positions = obj.read_positions(file)
            _check_count(file, len(positions), len(base))
            offsets = positions - base
            if not offsets.any() and file.stem.lower() in (*_NEUTRAL_NAMES, neutral.name.lower()):
                continue
            found.append((file.stem, offsets))
        elif name.endswith((".target", ".target.gz")):
            found.append((file.name[: name.index(".target")], _read_target(file, len(base))))
    return found


def _read_target(path: Path, count: int) -> Floats:
    """A MakeHuman target: lines ``vertex dx dy dz``."""
    data = read_bytes(path)
    if path.suffix.lower() == ".gz":
        try:
            with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
                data = file.read(256 << 20)
        except (OSError, EOFError, zlib.error):
            raise InputFileError(f"{path} is damaged: it cannot be unpacked") from None
    lines = TextLines(data, path)
    rows = lines.word_counts > 0
    rows[rows] = lines.bytes[lines.words[lines.first_word[rows]]] != ord("#")
    if (lines.word_counts[rows] != 4).any():
        bad = int(np.flatnonzero(rows)[int(np.argmax(lines.word_counts[rows] != 4))])
        raise lines.error(bad, "a target line needs a vertex number and three offsets")
    table = lines.numbers(rows, 0).reshape(-1, 4)
    ids = table[:, 0]
    if not np.isfinite(table).all() or ((ids < 0) | (ids >= count) | (ids != np.floor(ids))).any():
        raise MeshError(f"{path}: a line names no vertex of the neutral face (0 to {count - 1}) or no finite offset")
    offsets = np.zeros((count, 3))
    np.add.at(offsets, ids.astype(np.int64), table[:, 1:])
    return offsets


def _read_archive(path: Path, count: int) -> _Targets:
    arrays = read_npz(path, ("names", "deltas"))
    missing = [n for n in ("names", "deltas") if n not in arrays]
    if missing:
        raise InputFileError(f"{path} has no array '{missing[0]}'; names (K,) and deltas (K, N, 3) are needed")
    names, deltas = arrays["names"], arrays["deltas"]
    if names.ndim != 1 or names.dtype.kind not in "US" or deltas.ndim != 3 or deltas.dtype.kind not in "fiu":
        raise InputFileError(f"{path}: names must be (K,) text and deltas (K, N, 3) numbers")
    if deltas.shape[0] != len(names) or deltas.shape[2] != 3:
        raise InputFileError(f"{path}: {len(names)} names do not fit deltas of shape {deltas.shape}")
    _check_count(path, deltas.shape[1], count)
    labels = [n.decode("utf-8", "replace") if isinstance(n, bytes) else str(n) for n in names.tolist()]
    return list(zip(labels, deltas, strict=True))


def _read_gltf(path: Path, count: int) -> _Targets:
    """Morph targets of all meshes; meshes without targets may be missing in the neutral face."""
    own = gltf.read_shape_set(path)
    if own is not None:
        _check_count(path, len(own.neutral), count)
        return list(zip(own.names, own.deltas, strict=True))
    scene = gltf.read_foreign(path)
    targets = scene.document.targets if isinstance(scene.document, gltf.GltfDocument) else {}
    shapes = scene.shapes
    if scene.vertex_count != count:
        shapes = tuple(s for s in shapes if targets[s.name])
    _check_count(path, sum(s.mesh.vertex_count for s in shapes), count)
    names = dict.fromkeys(n for s in shapes for n in targets[s.name])
    found: _Targets = []
    for name in names:
        parts = []
        for s in shapes:
            offsets = targets[s.name].get(name)
            linear = scene.world_matrix(s.name)[:3, :3]
            parts.append(np.zeros((s.mesh.vertex_count, 3)) if offsets is None else offsets @ linear.T)
        found.append((name, np.concatenate(parts)))
    return found


def _read_usd(path: Path, count: int) -> _Targets:
    from formats.usd import read_shape_set

    found = read_shape_set(path)
    if found is None:
        return []
    _check_count(path, len(found.neutral), count)
    return list(zip(found.names, found.deltas, strict=True))


def write_shapes(shapes: ShapeSet, like: FaceScene, path: Path) -> None:
    """Write morph targets.

    Parameters
    ----------
    like : a scene with the polygons, groups and materials for OBJ files.
    path : NAME.npz, or a folder for one OBJ file a target. A new folder appears whole or not at all; in one that
        is there, each file is replaced whole.

    Raises
    ------
    OutputFileError
        If it cannot be written, or a target's name cannot be a file name.
    UnknownFormatError
        If the extension is of some other format.
    """
    path = Path(path)
    if path.suffix.lower() == ".npz":
        write_npz(path, {"names": np.array(shapes.names), "deltas": shapes.deltas, "neutral": shapes.neutral})
        return
    if path.suffix and not path.is_dir():
        raise UnknownFormatError(f"{path}: morph targets are written to an .npz file or to a folder of OBJ files")
    unfit = [n for n in shapes.names if not n or n.startswith(".") or set(n) & set('/\\:*?"<>|\0')]
    if unfit:
        raise OutputFileError(f"the morph target '{unfit[0][:60]}' cannot be a file name; write an .npz instead")
    if len(shapes.neutral) != like.vertex_count:
        raise MeshError(f"the morph targets have {len(shapes.neutral)} vertices, the scene {like.vertex_count}")
    if path.is_dir():
        obj.write_series(like, path, _targets(shapes))
        return
    try:
        folder = Path(tempfile.mkdtemp(prefix=f".{path.name[:32]}-", dir=path.parent))
    except OSError as error:
        raise OutputFileError(f"cannot write {path}: {error.strerror or error}; check the folder above") from error
    try:
        obj.write_series(like, folder, _targets(shapes))
        folder.chmod(0o755)
        folder.replace(path)
    except OSError as error:
        raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
    except OutputFileError as error:
        # The user never sees the folder's other name.
        raise OutputFileError(str(error).replace(str(folder), str(path))) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _targets(shapes: ShapeSet) -> Iterator[tuple[str, Floats]]:
    return ((name, shapes.neutral + offsets) for name, offsets in zip(shapes.names, shapes.deltas, strict=True))
