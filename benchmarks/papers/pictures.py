"""How the pictures of the page are kept: in few colours, so that they stay small."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from studio.sheet import save_png

COLORS = 256


def save(image: Image.Image, path: Path) -> None:
    """Write a PNG of few colours; small coloured spots, such as irises, keep theirs."""
    save_png(image.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE), path)
