"""Options that take as many words as follow: ``--targets a.obj b.obj c.obj``."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperOption


class Spread(TyperCommand):
    """A command whose ``multiple`` options may be followed by several words, up to the next option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its words, which is what the parser below understands."""
        many = {name for p in self.params if isinstance(p, TyperOption) and p.multiple for name in p.opts}
        spread: list[str] = []
        current: str | None = None
        for word in args:
            if word.startswith("-"):
                current = word if word in many else None
                spread += [] if current else [word]
            elif current is None:
                spread.append(word)
            else:
                spread += [current, word]
        return super().parse_args(ctx, spread)
