"""Inner loops that numba compiles where it is installed (the extra ``fast``); without it numpy does the work.

numba is imported when the first loop is asked for, never before, and what it compiled is kept on disk. Every loop has a
way in numpy beside it that finds the same; ``FBA_FAST=0`` takes that way even where numba is installed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

Loop = TypeVar("Loop", bound=Callable[..., Any])

SWITCH = "FBA_FAST"


def compiled(loop: Loop) -> Loop | None:
    """Return a function that stands at the top of a module, compiled at its first call; None to go without.

    Parameters
    ----------
    loop : of arrays and numbers, in what numba understands of Python.
    """
    return None if os.environ.get(SWITCH) == "0" else _compiled(loop)


@cache
def _compiled(loop: Loop) -> Loop | None:
    try:
        from numba import njit
    except ImportError:
        return None
    made: Loop = njit(loop, cache=True)
    return made
