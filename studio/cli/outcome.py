"""Exit codes, and how an error becomes one clear message."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable
from enum import IntEnum
from typing import NoReturn, ParamSpec

import typer

from fba.errors import FbaError

P = ParamSpec("P")


class Outcome(IntEnum):
    """Exit codes of the command line."""

    OK = 0
    FINDINGS = 1
    USAGE = 2
    BAD_INPUT = 3
    INTERRUPTED = 130
    READER_GONE = 141


def guarded(verb: Callable[P, None]) -> Callable[P, None]:
    """Let a verb end with an exit code and one message instead of a traceback."""

    @functools.wraps(verb)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            try:
                verb(*args, **kwargs)
            finally:
                sys.stdout.flush()
        except FbaError as error:
            fail(str(error))
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(Outcome.READER_GONE) from None
        except KeyboardInterrupt:
            print("fba: interrupted", file=sys.stderr)
            raise typer.Exit(Outcome.INTERRUPTED) from None
        except OSError as error:
            _drop_output()
            fail(f"{error.filename or 'standard output'}: {error.strerror or error}")
        except MemoryError:
            fail("there is not enough memory for this; close other programs or use a smaller face or stream")
        except RecursionError:
            traceback.print_exc(limit=3)
            fail("the input is nested too deeply")

    return run


def _drop_output() -> None:
    """Send what stdout still holds to nowhere, so that the interpreter does not fail on it while it ends."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
    except (OSError, ValueError):
        return


def _plain(message: str) -> str:
    """A message as one line: what it quotes of a file must not steer the terminal."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in message.replace("\n", " "))


def fail(message: str) -> None:
    """Print one message on stderr and end with BAD_INPUT."""
    print(f"fba: error: {_plain(message)}", file=sys.stderr)
    raise typer.Exit(Outcome.BAD_INPUT)


def usage(message: str) -> NoReturn:
    """Print one message on stderr and end with USAGE."""
    print(f"fba: usage: {_plain(message)}", file=sys.stderr)
    raise typer.Exit(Outcome.USAGE)
