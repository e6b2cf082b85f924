"""Animations: frame counts, times, colours, and that outputs are whole or absent."""

from __future__ import annotations

import builtins
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fba.errors import FapStreamError, MissingDependencyError, OutputFileError, UnknownFormatError
from studio import movie
from studio.movie import gif_schedule, write_animation


def moving_bar(count: int, height: int = 24, width: int = 40) -> Iterator[np.ndarray]:
    """A dark bar that wanders over a soft slope of colour."""
    slope = np.linspace(120, 240, width)[None, :, None] * np.array([1.0, 0.8, 0.7])
    for k in range(count):
        frame = np.broadcast_to(slope, (height, width, 3)).astype(np.uint8).copy()
        frame[:, k % width] = (20, 30, 90)
        yield frame


def gif_frames(path: Path) -> tuple[list[np.ndarray], list[int]]:
    with Image.open(path) as image:
        pictures, delays = [], []
        for k in range(image.n_frames):
            image.seek(k)
            delays.append(image.info["duration"])
            pictures.append(np.asarray(image.convert("RGB")))
        assert image.info.get("loop", 0) == 0
    return pictures, delays


@pytest.mark.parametrize(("fps", "delays"), [(25.0, {40}), (30.0, {30, 40}), (10.0, {100}), (12.5, {80})])
def test_gif_keeps_frames_and_times(tmp_path: Path, fps: float, delays: set[int]) -> None:
    written = write_animation(moving_bar(30), fps, tmp_path / "a.gif")
    pictures, found = gif_frames(tmp_path / "a.gif")
    assert len(pictures) == written.frames == 30
    assert set(found) == delays
    assert abs(sum(found) - 30_000 / fps) <= 10
    assert written.frame_rate == pytest.approx(fps)
    for shown, wanted in zip(pictures, moving_bar(30), strict=True):
        assert np.abs(shown.astype(int) - wanted).max() <= 12


def test_gif_above_50_frames_a_second_leaves_frames_out(tmp_path: Path) -> None:
    written = write_animation(moving_bar(100), 100.0, tmp_path / "a.gif")
    pictures, delays = gif_frames(tmp_path / "a.gif")
    assert written.frames == 100
    assert written.frame_rate == pytest.approx(50.0)
    assert len(pictures) == 50
    assert sum(delays) == 1000


def test_gif_schedule_agrees_with_the_file(tmp_path: Path) -> None:
    for fps in (24.0, 60.0, 29.97):
        write_animation(moving_bar(37), fps, tmp_path / "a.gif")
        _, delays = gif_frames(tmp_path / "a.gif")
        assert [10 * delay for _, delay in gif_schedule(37, fps)] == delays


def test_gif_keeps_rare_colours(tmp_path: Path) -> None:
    """A few blue pixels survive among thousands of skin tones."""
    rng = np.random.default_rng(0)
    frame = (np.array([200, 150, 120]) + rng.integers(-40, 40, (120, 120, 3))).astype(np.uint8)
    frame[50:54, 50:54] = (40, 70, 200)
    write_animation([frame], 25, tmp_path / "a.gif")
    pictures, _ = gif_frames(tmp_path / "a.gif")
    assert np.abs(pictures[0][51, 51].astype(int) - (40, 70, 200)).max() < 30


def test_gif_with_more_frames_than_the_palette_looks_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(movie, "PALETTE_BUFFER", 5 * 24 * 40 * 3)
    write_animation(moving_bar(20), 25, tmp_path / "a.gif")
    assert len(gif_frames(tmp_path / "a.gif")[0]) == 20


def test_same_frames_same_bytes(tmp_path: Path) -> None:
    for name in ("a.gif", "b.gif", "a", "b"):
        write_animation(moving_bar(5), 25, tmp_path / name)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert (tmp_path / "a" / "00003.png").read_bytes() == (tmp_path / "b" / "00003.png").read_bytes()


def test_mp4_is_a_film_of_that_many_frames(tmp_path: Path) -> None:
    program = movie.find_ffmpeg()
    if program is None:
        pytest.skip("needs ffmpeg")
    written = write_animation(moving_bar(12, 25, 41), 30000 / 1001, tmp_path / "a.mp4")
    assert written.frame_rate == pytest.approx(29.97, abs=1e-3)
    command = [program, "-i", str(tmp_path / "a.mp4"), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = subprocess.run(command, capture_output=True, check=True).stdout
    frames = np.frombuffer(decoded, np.uint8).reshape(12, 26, 42, 3)  # odd sizes grow by one
    for shown, wanted in zip(frames, moving_bar(12, 25, 41), strict=True):
        assert np.abs(shown[:25, :41].astype(int) - wanted).mean() < 10


def test_mp4_without_ffmpeg_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def blocked(name: str, *args: object, **kwargs: object) -> object:
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return real(name, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", blocked)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingDependencyError, match=r"fba-toolkit\[video\]"):
        write_animation(moving_bar(2), 25, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_mp4_failure_of_ffmpeg_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(movie, "find_ffmpeg", lambda: str(broken))
    with pytest.raises(OutputFileError, match="no such codec"):
        write_animation(moving_bar(200), 25, tmp_path / "a.mp4")
    assert [p.name for p in tmp_path.iterdir()] == ["ffmpeg"]


@pytest.mark.parametrize("name", ["frames", "frames.of.head/"])
def test_folder_of_png(tmp_path: Path, name: str) -> None:
    write_animation(moving_bar(3), 25, f"{tmp_path}/{name}")
    folder = tmp_path / name
    assert [p.name for p in sorted(folder.iterdir())] == ["00000.png", "00001.png", "00002.png"]
    for path, wanted in zip(sorted(folder.iterdir()), moving_bar(3), strict=True):
        assert np.array_equal(np.asarray(Image.open(path)), wanted)
    assert [p.name for p in tmp_path.iterdir()] == [folder.name]


def test_folder_of_frames_is_replaced_as_a_whole(tmp_path: Path) -> None:
    write_animation(moving_bar(7), 25, tmp_path / "frames")
    write_animation(moving_bar(2), 25, tmp_path / "frames")
    assert len(list((tmp_path / "frames").iterdir())) == 2


def test_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "holiday"
    folder.mkdir()
    (folder / "beach.png").write_bytes(b"dear")
    with pytest.raises(OutputFileError, match=r"beach\.png"):
        write_animation(moving_bar(2), 25, folder)
    assert (folder / "beach.png").read_bytes() == b"dear"


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "frames"])
def test_failure_half_way_leaves_the_old_output(tmp_path: Path, name: str) -> None:
    if name == "a.mp4" and movie.find_ffmpeg() is None:
        pytest.skip("needs ffmpeg")
    path = tmp_path / name
    write_animation(moving_bar(2), 25, path)
    before = sorted((p.name, p.read_bytes()) for p in tmp_path.rglob("*") if p.is_file())

    def failing() -> Iterator[np.ndarray]:
        yield from moving_bar(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_animation(failing(), 25, path)
    assert sorted((p.name, p.read_bytes()) for p in tmp_path.rglob("*") if p.is_file()) == before
    assert len(list(tmp_path.iterdir())) == 1


def test_wrong_requests_are_told(tmp_path: Path) -> None:
    with pytest.raises(UnknownFormatError, match="webm"):
        write_animation(moving_bar(2), 25, tmp_path / "a.webm")
    with pytest.raises(FapStreamError, match="no frames"):
        write_animation([], 25, tmp_path / "a.gif")
    with pytest.raises(FapStreamError, match="frame rate"):
        write_animation(moving_bar(2), 0, tmp_path / "a.gif")
    with pytest.raises(FapStreamError, match="one size"):
        write_animation([np.zeros((4, 4, 3), np.uint8), np.zeros((4, 5, 3), np.uint8)], 25, tmp_path / "a.gif")
    with pytest.raises(OutputFileError):
        write_animation(moving_bar(2), 25, tmp_path / "missing" / "a.gif")
    assert not list(tmp_path.iterdir())
