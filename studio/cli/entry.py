"""How the command starts: an interrupt while the packages load ends it as quietly as a later one."""

from __future__ import annotations

import sys


def main() -> None:
    """Entry point of the command ``fba``."""
    try:
        from studio.cli.app import app

        app()
    except KeyboardInterrupt:
        print("fba: interrupted", file=sys.stderr)
        sys.exit(130)
