"""Points of photographs found by MediaPipe, which runs in an environment of its own."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

from fba.errors import FbaError, LandmarkError

COMMANDS = "python3.11 -m venv DETECTOR && DETECTOR/bin/pip install mediapipe==0.10.21"
INSTALL = f"{COMMANDS}, then --detector DETECTOR/bin/python"
"""The last release that carries its models; it needs an older numpy than this toolkit, so it lives apart."""

FBA_DETECTOR = "FBA_DETECTOR"
"""Environment variable: the python of an environment with MediaPipe."""

MINUTES = 10

FACE_MESH = {
    "2.1": 152, "2.2": 13, "2.3": 14, "2.4": 308, "2.5": 78, "2.6": 311, "2.7": 81, "2.8": 402, "2.9": 178,
    "2.11": 378, "2.12": 149, "2.13": 397, "2.14": 172, "3.1": 386, "3.2": 159, "3.3": 374, "3.4": 145, "3.7": 263,
    "3.8": 133, "3.11": 362, "3.12": 33, "4.1": 336, "4.2": 107, "4.3": 334, "4.4": 105, "4.5": 300, "4.6": 70,
    "5.1": 280, "5.2": 50, "5.3": 347, "5.4": 118, "8.1": 0, "8.2": 17, "8.3": 291, "8.4": 61, "8.5": 270, "8.6": 40,
    "8.7": 321, "8.8": 91, "8.9": 37, "8.10": 267, "9.1": 327, "9.2": 98, "9.3": 1, "9.6": 193, "9.7": 417, "9.12": 197,
    "9.13": 419, "9.14": 196, "9.15": 2, "11.1": 10, "11.2": 103, "11.3": 332, "outline left": 323,
    "outline right": 93, "temple left": 389, "temple right": 162,
}  # fmt: skip
"""MPEG-4 point -> landmark of MediaPipe's face mesh; four more close the outline at cheeks and temples."""


class DetectorError(FbaError):
    """The detector of picture points does not run."""


def detector_version(python: str) -> str:
    """The version of MediaPipe in an environment, without loading it.

    Parameters
    ----------
    python : the interpreter of the environment.

    Raises
    ------
    DetectorError
        If it does not start, or has no MediaPipe; the message says what to install.
    """
    ask = "from importlib.metadata import version; print(version('mediapipe'))"
    try:
        done = subprocess.run([python, "-c", ask], capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DetectorError(f"the detector {python} does not run ({error}); set it up with: {INSTALL}") from None
    if done.returncode != 0:
        raise DetectorError(f"the environment of {python} has no mediapipe; set it up with: {INSTALL}")
    return done.stdout.strip()


def detect_picture_points(python: str, paths: Sequence[Path]) -> list[dict[str, tuple[float, float]]]:
    """Find the points of one face in each picture.

    Parameters
    ----------
    python : the interpreter of an environment with MediaPipe.

    Raises
    ------
    DetectorError
        If it does not start or fails; the message says what to install.
    LandmarkError
        If there is no face in a picture.
    """
    script = Path(__file__).with_name("mediapipe_faces.py")
    try:
        done = subprocess.run(
            [python, str(script), *(str(p.absolute()) for p in paths)],
            capture_output=True, text=True, timeout=60 * MINUTES, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DetectorError(f"the detector {python} does not run ({error}); set it up with: {INSTALL}") from None
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise DetectorError(f"the detector {python} failed ({last}); set it up with: {INSTALL}")
    try:
        found = json.loads(done.stdout)
    except ValueError:
        raise DetectorError(f"the detector {python} does not answer in JSON; set it up with: {INSTALL}") from None
    out = []
    for path, mesh in zip(paths, found, strict=True):
        if not mesh:
            raise LandmarkError(f"{path}: the detector finds no face; place the points by hand (--template)")
        out.append({name: (float(mesh[i][0]), float(mesh[i][1])) for name, i in FACE_MESH.items()})
    return out
