"""How the command starts: an interrupt while the packages load ends it as quietly as a later one."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Entry point of the command ``fba``."""
    # The matrices are small: a second thread of OpenBLAS waits more than it works, and takes a third more of the
    # processor for a clone.
    if "OMP_NUM_THREADS" not in os.environ:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from studio.cli.app import app

        app()
    except KeyboardInterrupt:
        print("fba: interrupted", file=sys.stderr)
        sys.exit(130)
