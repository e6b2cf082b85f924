"""The list of verbs."""

from __future__ import annotations

from typing import Annotated

import typer

from studio.cli.analogy import analogy
from studio.cli.author import author
from studio.cli.check import check
from studio.cli.clone import clone
from studio.cli.compare import compare
from studio.cli.convert import convert
from studio.cli.demo import demo
from studio.cli.doctor import doctor
from studio.cli.export import export
from studio.cli.inspect import inspect
from studio.cli.landmarks import landmarks
from studio.cli.outcome import guarded
from studio.cli.play import play
from studio.cli.spread import Spread

app = typer.Typer(
    name="fba",
    help="Make a plain face mesh animatable: MPEG-4 Facial Animation Tables, cloned, played and checked.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

for verb in (demo, inspect, landmarks, clone, author, export, convert, play, check, compare, analogy, doctor):
    app.command(cls=Spread)(guarded(verb))


def _version(wanted: bool) -> None:
    if wanted:
        from fba import __version__

        print(f"fba-toolkit {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    del version
