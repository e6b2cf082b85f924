"""Measurements in processes of their own: one thread, seconds of the processor, medians."""

from __future__ import annotations

import json
import os
import re
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def seconds(work: Callable[[], object], runs: int = 1) -> float:
    """Processor seconds of a call; the least of some."""
    best = float("inf")
    for _ in range(runs):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def peak_memory() -> float:
    """MB that this process has held at most; where Linux tells, without what the process held that started it."""
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return (float(found[1]) if found else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024


def measured(
    module: str, *arguments: str, folder: Path | None = None, setting: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """What a module prints as JSON, run in a process of its own.

    Parameters
    ----------
    folder : of the program, None = this one.
    setting : variables of the environment.
    """
    command = [sys.executable, "-m", module, *arguments]
    environment = {**os.environ, **ONE_THREAD, **(setting or {})}
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment, cwd=folder)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def medians(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The median of each number."""
    return {key: statistics.median(row[key] for row in rows) for key in rows[0]}
