"""``fba play``: play a FAP stream on an animatable face."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from studio.cli.arguments import FacePath, OutPath
from studio.cli.outcome import usage


def play(
    face: FacePath,
    stream: Annotated[Path, typer.Argument(help="A .fap stream; 'demo' names the shipped one.")],
    output: OutPath,
    size: Annotated[int, typer.Option(min=32, max=4096, help="Height and width of the picture in pixels.")] = 360,
    hold: Annotated[
        bool, typer.Option("--hold", help="A FAP that a frame leaves out keeps its last value instead of 0.")
    ] = False,
    rules: Annotated[
        str,
        typer.Option(
            help="Combine FAPs that fight by: all, none (plain sum), or some of corners,contours,brows,lids,lips."
        ),
    ] = "all",
) -> None:
    """Play a FAP stream on a face: into .gif, .mp4, a folder of .png, or .npz (vertices of every frame)."""
    from fba.errors import UnknownFormatError
    from formats import read_face
    from formats.fap import read_fap
    from samples import sample
    from studio.cli.arguments import parse_rules
    from studio.cli.console import console, print_findings, progress
    from studio.playback import draw_frames, write_vertices

    try:
        chosen = parse_rules(rules)
    except ValueError as error:
        usage(f"--rules: {error}")
    suffix = output.suffix.lower()
    if suffix not in (".gif", ".mp4", ".npz", ""):
        raise UnknownFormatError(f"{output}: choose .gif, .mp4, .npz, or a folder (no extension) for .png frames")
    animatable = read_face(str(face))
    path = sample("streams/demo.fap") if str(stream) == "demo" else stream
    frames, findings = read_fap(path)
    if hold:
        frames = frames.held()
    out = console()
    print_findings(findings, out)
    with progress() as tell:
        if suffix == ".npz":
            write_vertices(animatable, frames, output, chosen)
        else:
            draw_frames(animatable, frames, output, size, tell, chosen)
    out.print(f"{output}: {len(frames)} frames at {frames.frame_rate:g}/s")
