"""Animated pictures: GIF, MP4, or a folder of PNG. Every output is whole or absent."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain, islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fba.errors import FapStreamError, MissingDependencyError, OutputFileError, UnknownFormatError
from formats.files import atomic_output

UInt8 = NDArray[np.uint8]

GIF_SHORTEST = 2
"""Shortest delay that viewers keep, in 1/100 s; they play anything faster at 10 frames/s."""
PALETTE_FRAMES = 12
PALETTE_BUFFER = 256 << 20
"""Bytes of frames that are looked at to choose the colours of a GIF."""
FRAME_NAME = re.compile(r"\d{5,}\.png")
CRF = 18
"""x264's quality: 18 is hard to tell from the original."""


@dataclass(frozen=True)
class Animation:
    """What was written.

    Attributes
    ----------
    frames : number of pictures taken from the iterator.
    frame_rate : pictures in a second as the file plays them. GIF counts delays in 1/100 s: delays of unequal
        length keep the mean rate; above 50 frames/s pictures are left out.
    """

    path: Path
    frames: int
    frame_rate: float


def write_animation(frames: Iterable[UInt8], fps: float, path: str | Path) -> Animation:
    """Write pictures as an animation; the name chooses how.

    Parameters
    ----------
    frames : (h, w, 3) uint8 pictures of one size.
    fps : pictures in a second.
    path : ``.gif``; ``.mp4``; or a folder for 00000.png ...: a name without extension or one ending in "/".

    Raises
    ------
    UnknownFormatError
        If the extension is another one.
    MissingDependencyError
        If .mp4 is wanted and there is no ffmpeg.
    OutputFileError
        If the file cannot be written, or the folder holds other things than frames.
    FapStreamError
        If there are no frames, or they differ in size.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise FapStreamError(f"the frame rate must be a positive number, not {fps}")
    folder = str(path).endswith(("/", "\\"))
    path = Path(path)
    suffix = path.suffix.lower()
    checked = _one_size(frames)
    if folder or path.is_dir() or not suffix:
        return _write_folder(checked, fps, path)
    if suffix == ".gif":
        return _write_gif(checked, fps, path)
    if suffix == ".mp4":
        return _write_mp4(checked, fps, path)
    raise UnknownFormatError(f"no animation can be written as '{suffix}' ({path}); use .gif, .mp4 or a folder")


def _one_size(frames: Iterable[UInt8]) -> Iterator[UInt8]:
    shape: tuple[int, ...] | None = None
    for frame in frames:
        if shape is None:
            shape = frame.shape
        if frame.shape != shape or frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise FapStreamError(f"frames must all be (h, w, 3) uint8 of one size; got {frame.shape} after {shape}")
        yield frame
    if shape is None:
        raise FapStreamError("there are no frames to write; the stream is empty")


def gif_schedule(count: int, fps: float) -> list[tuple[int, int]]:
    """Choose which frames a GIF shows and for how long.

    Returns
    -------
    (frame, delay in 1/100 s): each picture starts at its own time rounded to 1/100 s, so that errors never add up;
    pictures that would last shorter than viewers can show are left out.

    >>> gif_schedule(4, 30.0)
    [(0, 3), (1, 4), (2, 3), (3, 3)]
    """
    shown: list[tuple[int, int]] = []
    for index in range(count):
        time = _centiseconds(index, fps)
        if not shown or time - shown[-1][1] >= GIF_SHORTEST:
            shown.append((index, time))
    end = max(_centiseconds(count, fps), shown[-1][1] + GIF_SHORTEST) if shown else 0
    ends = [*(time for _, time in shown[1:]), end]
    return [(index, stop - time) for (index, time), stop in zip(shown, ends, strict=True)]


def _centiseconds(index: int, fps: float) -> int:
    return int(100.0 * index / fps + 0.5)


def _write_gif(frames: Iterator[UInt8], fps: float, path: Path) -> Animation:
    first = next(frames)
    buffered = [first, *islice(frames, max(PALETTE_BUFFER // first.nbytes, 1) - 1)]
    palette, table = _shared_palette(buffered)
    counted, shown = [0], [0]

    def pictures() -> Iterator[Image.Image]:
        waiting: tuple[int, Image.Image] | None = None
        for frame in chain(_drain(buffered), frames):
            start = _centiseconds(counted[0], fps)
            counted[0] += 1
            if waiting is not None and start - waiting[0] < GIF_SHORTEST:
                continue
            if waiting is not None:
                yield _timed(waiting[1], start - waiting[0])
            shown[0] += 1
            waiting = (start, _indexed(frame, palette, table))
        if waiting is not None:
            yield _timed(waiting[1], max(_centiseconds(counted[0], fps) - waiting[0], GIF_SHORTEST))

    with atomic_output(path) as temporary:
        sequence = pictures()
        head = next(sequence)
        options = {"loop": 0, "optimize": False, "disposal": 1}
        head.save(temporary, format="GIF", save_all=True, append_images=sequence, **options)
    return Animation(path, counted[0], shown[0] * fps / counted[0])


def _drain(frames: list[UInt8]) -> Iterator[UInt8]:
    while frames:
        yield frames.pop(0)


def _timed(image: Image.Image, delay: int) -> Image.Image:
    image.info["duration"] = 10 * delay
    return image


def _shared_palette(frames: list[UInt8]) -> tuple[list[int], UInt8]:
    """Colours for all frames, and a table from 18-bit colours (6 bits a channel) to the nearest of them."""
    picks = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, PALETTE_FRAMES).astype(int))]
    codes, counts = np.unique(_six_bits(np.concatenate(picks)), return_counts=True)
    colors = np.stack([codes >> 12, codes >> 6 & 63, codes & 63], axis=1).astype(np.uint8) * 4 + 2
    # Rare colours (eyes, teeth) count by the square root: they matter more than their area says.
    sample = np.repeat(colors, np.ceil(np.sqrt(counts)).astype(int), axis=0)
    chosen = Image.fromarray(sample[None]).quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    levels = np.arange(64, dtype=np.uint8) * 4 + 2
    grid = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(512, 512, 3)
    table = np.asarray(Image.fromarray(grid).quantize(palette=chosen, dither=Image.Dither.NONE)).ravel()
    return list(chosen.getpalette() or []), table


def _six_bits(colors: UInt8) -> NDArray[np.int32]:
    """Colours (..., 3) as 18-bit numbers."""
    six = (colors >> 2).astype(np.int32)
    return np.asarray((six[..., 0] << 12) | (six[..., 1] << 6) | six[..., 2])


def _indexed(frame: UInt8, palette: list[int], table: UInt8) -> Image.Image:
    image = Image.frombytes("P", (frame.shape[1], frame.shape[0]), table[_six_bits(frame)].tobytes())
    image.putpalette(palette)
    return image


def find_ffmpeg() -> str | None:
    """Path of an ffmpeg program: the one of imageio-ffmpeg, else the one on PATH, else None."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        return shutil.which("ffmpeg")


def _write_mp4(frames: Iterator[UInt8], fps: float, path: Path) -> Animation:
    program = find_ffmpeg()
    if program is None:
        raise MissingDependencyError("imageio-ffmpeg", "video", "writing .mp4")
    first = next(frames)
    height, width = first.shape[:2]
    rate = Fraction(fps).limit_denominator(1001)
    with atomic_output(path) as temporary, tempfile.TemporaryFile() as log:
        command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
        command += ["-s", f"{width + width % 2}x{height + height % 2}", "-r", str(rate), "-i", "-"]
        command += ["-an", "-c:v", "libx264", "-crf", str(CRF), "-pix_fmt", "yuv420p", "-threads", "1"]
        command += ["-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart", str(temporary)]
        count = 0
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log) as process:
            try:
                for frame in chain([first], frames):
                    _feed(process, _even(frame).tobytes())
                    count += 1
                _feed(process, None)
            except BaseException:
                process.kill()
                _feed(process, None)
                raise
        if process.returncode != 0:
            log.seek(0)
            reason = log.read().decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
            raise OutputFileError(f"cannot write {path}: ffmpeg failed: {reason[0]}")
    return Animation(path, count, float(rate))


def _feed(process: subprocess.Popen[bytes], data: bytes | None) -> None:
    """Hand bytes to a program, or (None) end its input; one that has died says why by its exit code and log."""
    if process.stdin is None:
        return
    try:
        if data is None:
            process.stdin.close()
        else:
            process.stdin.write(data)
    except BrokenPipeError:
        process.stdin = None


def _even(frame: UInt8) -> UInt8:
    """Repeat the last row and column where needed: video wants even sizes."""
    height, width = frame.shape[:2]
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


def _write_folder(frames: Iterator[UInt8], fps: float, path: Path) -> Animation:
    """Write 00000.png ... into a new folder beside `path`, then put it in the place of `path`."""
    if path.exists() and not path.is_dir():
        raise OutputFileError(f"cannot write the folder {path}: a file of that name exists")
    strangers = [p.name for p in sorted(path.iterdir()) if not FRAME_NAME.fullmatch(p.name)] if path.is_dir() else []
    if strangers:
        raise OutputFileError(
            f"the folder {path} holds other things than frames ('{strangers[0]}'); choose a new or an empty folder"
        )
    try:
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{path.name[:32]}-", dir=path.absolute().parent))
    except OSError as error:
        raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
    try:
        made, old = temporary / "new", temporary / "old"
        made.mkdir()
        count = 0
        for count, frame in enumerate(frames, start=1):
            Image.fromarray(frame).save(made / f"{count - 1:05d}.png", compress_level=6)
        if path.is_dir():
            path.rename(old)
        made.rename(path)
    except OSError as error:
        raise OutputFileError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return Animation(path, count, fps)
