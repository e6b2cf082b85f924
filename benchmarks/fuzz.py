"""Throw damaged files at the readers: ``python -m benchmarks.fuzz fba wrl --minutes 10``.

Every reader must end with a result or an FbaError, soon and in little memory. With ``--atheris`` (pip install atheris)
the mutations are led by coverage; otherwise files are mutated at random from a seed, which needs nothing. What falls
out is written to a folder, one file a find; it belongs into the tests then.

The toolkit is imported inside functions: coverage is seen only in modules that are imported under atheris' eyes.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import random
import re
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

from benchmarks.fuzz_mutations import mutated

Target = Callable[[bytes], object]

SLOW = 10.0
"""Seconds after which a file of some kilobytes is a find."""


def _fap(data: bytes) -> object:
    from formats.fap import parse_fap

    return parse_fap(data)


def _fba(data: bytes) -> object:
    from formats.fba_bitstream import decode_fba, encode_fba

    stream, _ = decode_fba(data)
    return encode_fba(stream) if len(stream) < 200 else stream


def _csv(data: bytes) -> object:
    from formats.arkit_csv import format_arkit_csv, parse_arkit_csv

    stream, _ = parse_arkit_csv(data)
    return format_arkit_csv(stream)


def _cues(data: bytes) -> object:
    from formats.rhubarb import parse_rhubarb

    return parse_rhubarb(data)


STREAMS: Mapping[str, Target] = {"fap": _fap, "fba": _fba, "csv": _csv, "cues": _cues}

SCENES = ("bt", "glb", "gltf", "mtl", "obj", "off", "ply", "stl", "usda", "wfm", "wrl", "x3d", "xmt")
"""Kinds of scenes: the extension of the file, but for mtl, the materials of an .obj."""


def _scene(kind: str) -> Target:
    """A reader of scenes, fed through a file."""
    from benchmarks.fuzz_seeds import OBJ
    from fba.errors import FapStreamError
    from formats import read
    from formats.streams import STREAM_FORMATS, read_stream

    with_stream = any(f".{kind}" in f.extensions for f in STREAM_FORMATS)
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    path = folder / f"x.{kind}"
    mesh = folder / "x.obj" if kind == "mtl" else path
    mesh.write_bytes(OBJ)

    def target(data: bytes) -> object:
        path.write_bytes(data)
        if not with_stream:
            return read(mesh)
        try:
            read_stream(path)
        except FapStreamError:
            return read(path)  # Not every scene holds a stream.
        return read(path)

    return target


def kinds() -> list[str]:
    """What can be read here."""
    from formats import formats

    known = {e for f in formats() if f.reads for e in f.extensions}
    return [*STREAMS, *(k for k in SCENES if f".{k}" in known or k == "mtl")]


def target_of(kind: str) -> Target:
    """The reader of a kind of file."""
    return STREAMS[kind] if kind in STREAMS else _scene(kind)


@cache
def seeds(kind: str) -> list[bytes]:
    """Good files of a kind, small enough that mutations reach everything."""
    from benchmarks.fuzz_seeds import scene_seeds, stream_seeds

    return stream_seeds(kind) if kind in STREAMS else scene_seeds(kind)


def check(target: Target, data: bytes) -> str | None:
    """What is wrong with how a reader ends, or None."""
    from fba.errors import FbaError

    start = time.monotonic()
    try:
        target(data)
    except FbaError as error:
        if not str(error):
            return "an error without a message"
    except Exception:
        return traceback.format_exc()
    seconds = time.monotonic() - start
    return f"took {seconds:.1f} s for {len(data)} bytes" if seconds > SLOW else None


class Finds:
    """Files that a reader ends badly with: one of each place is written to the folder."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.tried = 0
        self._kind = kind
        self._folder = folder
        self._known: set[str] = set()

    def __len__(self) -> int:
        return len(self._known)

    def try_file(self, target: Target, data: bytes) -> None:
        """Give a file to the reader."""
        self.tried += 1
        said = check(target, data)
        if said is None:
            return
        place = re.sub(r"[0-9.]+", "", said) if said.startswith("took") else "".join(said.splitlines()[-3:-1])
        if place not in self._known:
            self._known.add(place)
            path = self._folder / f"{self._kind}_{hashlib.sha1(data).hexdigest()[:8]}.bin"
            path.write_bytes(data)
            print(f"{path}: {said}", file=sys.stderr)


def at_random(kind: str, folder: Path, seed: int, minutes: float = math.inf, files: float = math.inf) -> Finds:
    """Try files that are mutated at random, for so long or so many; the same seed gives the same files."""
    source, pool, target = random.Random(seed), seeds(kind), target_of(kind)
    end = time.monotonic() + 60.0 * minutes
    finds = Finds(kind, folder)
    while time.monotonic() < end and finds.tried < files:
        finds.try_file(target, mutated(kind, source.choice(pool), source, pool))
    return finds


def by_coverage(kind: str, minutes: float, folder: Path) -> None:
    """Let atheris look for files; it ends the process itself. A file that takes too long ends it early."""
    import atheris

    corpus = folder / f"corpus_{kind}"
    corpus.mkdir(parents=True, exist_ok=True)
    with atheris.instrument_imports(include=["formats", "fba", "fat"]):
        target, pool = target_of(kind), seeds(kind)
        for k, data in enumerate(pool):
            (corpus / f"seed_{k}").write_bytes(data)
            target(data)
    words = folder / f"words_{kind}.txt"
    words.write_text("\n".join(f'"{w}"' for w in words_of(pool)))
    finds = Finds(kind, folder)
    limits = [
        f"-max_total_time={int(60 * minutes)}",
        "-max_len=16384",
        "-rss_limit_mb=3000",
        f"-timeout={2 * SLOW:.0f}",
    ]
    where = [f"-artifact_prefix={folder}/{kind}_", f"-dict={words}", "-print_final_stats=1", str(corpus)]

    def mutate(data: bytes, most: int, seed: int) -> bytes:
        source = random.Random(seed)
        if not data or source.random() < 0.4:
            found: bytes = atheris.Mutate(data, most)
            return found
        return mutated(kind, data, source, pool)[:most]

    arguments = [sys.argv[0], *limits, *where]
    atheris.Setup(arguments, lambda data: finds.try_file(target, data), custom_mutator=mutate)
    atheris.Fuzz()


def words_of(files: list[bytes]) -> list[str]:
    """Words of the good files, for mutations to put in."""
    found = {w.decode() for data in files for w in re.findall(rb"[A-Za-z][A-Za-z0-9_:]{2,30}", data)}
    return sorted(found | {"-1", "1e999", "nan", "4294967296", "-0", "0x7fffffff"})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="+", choices=[*STREAMS, *SCENES])
    parser.add_argument("--minutes", type=float, default=1.0, help="for each kind")
    parser.add_argument("--folder", type=Path, default=Path("out/fuzz"), help="where finds go")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--memory", type=float, default=4.0, help="GiB of address space that a reader may use")
    parser.add_argument("--atheris", action="store_true", help="led by coverage; one kind, atheris must be installed")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    most = int(given.memory * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    if given.atheris:
        by_coverage(given.kinds[0], given.minutes, given.folder)
        return
    count = 0
    for kind in given.kinds:
        finds = at_random(kind, given.folder, given.seed, given.minutes)
        count += len(finds)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{kind}: {finds.tried} files, {len(finds)} finds, peak memory {peak:.0f} MB")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
