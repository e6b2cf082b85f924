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
        alone = ""  # An option that no word has followed yet.
        for word in args:
            if word.startswith("-"):
                if alone:
                    break
                name, joined, _ = word.partition("=")  # --targets=a.obj b.obj
                current = name if name in many else None
                alone = word if current and not joined else ""
                spread += [] if alone else [word]
            else:
                spread += [word] if current is None else [current, word]
                alone = ""
        if alone:
            ctx.fail(f"Option '{alone}' requires an argument.")
        return super().parse_args(ctx, spread)
