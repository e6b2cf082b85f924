"""Why a bar, or its aim, is not reached."""

from __future__ import annotations

REASONS: dict[str, str] = {}
