"""``fba play``: play a FAP stream on an animatable face."""

from __future__ import annotations

from typing import Annotated

import typer

from studio.cli.arguments import FacePath, OutPath, StreamPath, StreamRate
from studio.cli.outcome import usage


def play(
    face: FacePath,
    stream: StreamPath,
    output: OutPath,
    rate: StreamRate = None,
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
    """Play a stream on a face: into .gif, .mp4, a folder of .png, or .npz (vertices of every frame)."""
    from fat.open_jaw import open_jaw_mode
    from fba.errors import UnknownFormatError
    from formats import read_face
    from studio.cli.arguments import parse_rules
    from studio.cli.console import console, print_findings, progress
    from studio.playback import draw_frames, write_vertices
    from studio.streams import open_stream

    try:
        chosen = parse_rules(rules)
    except ValueError as error:
        usage(f"--rules: {error}")
    suffix = output.suffix.lower()
    if suffix not in (".gif", ".mp4", ".npz", ""):
        raise UnknownFormatError(f"{output}: choose .gif, .mp4, .npz, or a folder (no extension) for .png frames")
    animatable = read_face(str(face))
    frames, findings = open_stream(stream, rate, strict_jaw=open_jaw_mode(animatable) == "strict")
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
