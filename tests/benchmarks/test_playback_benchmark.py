from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "playback.py"


def test_it_runs_and_agrees_with_the_plain_loop() -> None:
    command = [sys.executable, str(SCRIPT), "--vertices", "900", "--frames", "16", "--runs", "1"]
    output = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout
    assert len(re.findall(r": [\d,]+ frames/s, [\d,]+ in 4-byte numbers", output)) == 4
    difference = re.search(r"largest difference between them: (\S+), in 4-byte numbers (\S+)", output)
    assert difference is not None
    assert float(difference[1]) < 1e-12
    assert float(difference[2]) < 1e-5
