"""The command ``fba``: one module a verb. Only this layer exits, prints, and turns errors into exit codes."""

from __future__ import annotations

from studio.cli.entry import main

__all__ = ["main"]
