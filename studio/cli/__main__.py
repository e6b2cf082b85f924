"""``python -m studio.cli``: the command without its script."""

from __future__ import annotations

from studio.cli.entry import main

main()
