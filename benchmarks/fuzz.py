"""Throw damaged files at the readers: ``python -m benchmarks.fuzz fba --minutes 10``.

Every reader must end with a result or an FbaError, soon and in little memory. With ``--atheris`` (pip install atheris)
the mutations are led by coverage; otherwise files are mutated at random from a seed, which needs nothing. What falls
out is written to a folder, one file a find; it belongs into the tests then.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path

from fba.errors import FbaError

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

SCENES = ("bt", "glb", "obj", "off", "ply", "stl", "wrl")
"""Extensions of scenes that are read from a file of that name."""

_TETRAHEDRON = b"""o skin
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
f 1/1 3/3 2/2
f 1/1 2/2 4/3
f 2 3 4
f 1 4 3
"""


def _scene(extension: str) -> Target:
    """A reader of scenes, fed through a file."""
    from formats import read

    folder = tempfile.mkdtemp(prefix="fuzz-")
    path = Path(folder) / f"x.{extension}"

    def target(data: bytes) -> object:
        path.write_bytes(data)
        return read(path)

    return target


def target_of(name: str) -> Target:
    """The reader of a kind of file."""
    return STREAMS[name] if name in STREAMS else _scene(name)


def seeds(name: str) -> list[bytes]:
    """Good files of a kind, small enough that mutations reach everything."""
    return _stream_seeds(name) if name in STREAMS else _scene_seeds(name)


def _scene_seeds(extension: str) -> list[bytes]:
    from formats import read_scene, write

    with tempfile.TemporaryDirectory() as folder:
        first, second = Path(folder) / "first.obj", Path(folder) / f"second.{extension}"
        first.write_bytes(_TETRAHEDRON)
        if extension == "obj":
            return [_TETRAHEDRON]
        write(read_scene(first), second)
        return [second.read_bytes()]


def _stream_seeds(target: str) -> list[bytes]:
    import numpy as np

    from fba import FapStream
    from formats.arkit_csv import format_arkit_csv
    from formats.fap import read_fap, write_fap
    from formats.fba_bitstream import encode_fba
    from samples import sample

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
    if target == "fba":
        return [encode_fba(s, q)[0] for s in (short, plain) for q in (0, 1, 9)]
    if target == "csv":
        return [format_arkit_csv(s)[0].encode() for s in (short, plain)]
    if target == "fap":
        with tempfile.TemporaryDirectory() as folder:
            paths = [Path(folder) / name for name in ("short.fap", "plain.fap")]
            for stream, path in zip((short, plain), paths, strict=True):
                write_fap(stream, path)
            return [path.read_bytes() for path in paths]
    cue = b'{"start": 0.1, "end": 0.3, "value": "D"}'
    return [b"0.00\tX\n0.05\tD\n0.27\tC\n0.47\tX\n", b'{"mouthCues": [' + cue + b", " + cue.replace(b"D", b"A") + b"]}"]


def mutated(data: bytes, source: random.Random, others: list[bytes]) -> bytes:
    """A file with a few random changes: bits, bytes, cuts, repeats, pieces of other files, odd numbers."""
    out = bytearray(data)
    odd = (b"0", b"-1", b"1e999", b"nan", b"9" * 20, b"\0", b"\xff" * 4, b"[" * 50, b'"', b",", b"\n", b"\0\0\1\xbb")
    for _ in range(source.choice((1, 1, 2, 4, 16))):
        at = source.randrange(len(out) + 1)
        length = min(source.choice((1, 1, 4, 32, 256)), len(out) - at)
        kind = source.randrange(6)
        if kind == 0 and length:
            out[at] ^= 1 << source.randrange(8)
        elif kind == 1:
            out[at : at + length] = source.randbytes(length)
        elif kind == 2:
            del out[at : at + length]
        elif kind == 3:
            out[at:at] = out[at : at + length] * source.choice((1, 2, 50))
        elif kind == 4:
            other = source.choice(others)
            start = source.randrange(len(other))
            out[at : at + length] = other[start : start + length]
        else:
            out[at : at + length] = source.choice(odd)
    return bytes(out)


def check(target: Target, data: bytes) -> str | None:
    """What is wrong with how a reader ends, or None."""
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


def at_random(name: str, minutes: float, folder: Path, seed: int) -> tuple[int, int]:
    """Numbers of files tried and of finds; the finds are written to the folder."""
    source, pool, target = random.Random(seed), seeds(name), target_of(name)
    end = time.monotonic() + 60.0 * minutes
    tried, known = 0, set[str]()
    while time.monotonic() < end:
        data = mutated(source.choice(pool), source, pool)
        said = check(target, data)
        tried += 1
        if said is not None:
            place = "".join(said.splitlines()[-3:])
            if place not in known:
                known.add(place)
                path = folder / f"{name}_{len(known)}.bin"
                path.write_bytes(data)
                print(f"{path}: {said}", file=sys.stderr)
    return tried, len(known)


def by_coverage(name: str, minutes: float, folder: Path) -> None:
    """Let atheris look for files; it ends the process itself."""
    import atheris

    corpus = folder / f"corpus_{name}"
    corpus.mkdir(parents=True, exist_ok=True)
    with atheris.instrument_imports(include=["formats", "fba", "fat"]):
        target = target_of(name)
        for k, data in enumerate(seeds(name)):
            (corpus / f"seed_{k}").write_bytes(data)
            target(data)

    def one(data: bytes) -> None:
        said = check(target, data)
        if said is not None:
            raise AssertionError(said)

    limits = [f"-max_total_time={int(60 * minutes)}", "-max_len=8192", "-rss_limit_mb=2048", "-timeout=30"]
    atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={folder}/{name}_", str(corpus)], one)
    atheris.Fuzz()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="+", choices=sorted([*STREAMS, *SCENES]))
    parser.add_argument("--minutes", type=float, default=1.0, help="for each target")
    parser.add_argument("--folder", type=Path, default=Path("out/fuzz"), help="where finds go")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--atheris", action="store_true", help="led by coverage; one target, atheris must be installed")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.atheris:
        by_coverage(given.targets[0], given.minutes, given.folder)
        return
    finds = 0
    for name in given.targets:
        tried, found = at_random(name, given.minutes, given.folder, given.seed)
        finds += found
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{name}: {tried} files, {found} finds, peak memory {peak:.0f} MB")
    sys.exit(1 if finds else 0)


if __name__ == "__main__":
    main()
