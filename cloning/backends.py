"""Named backends: ways to carry the skin's motion from one face to another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol, cast, runtime_checkable

from cloning.prepare import PreparedFace
from fba.arrays import Floats
from fba.errors import CloningError


class SkinTransfer(Protocol):
    """Carries offsets of a source's skin to a target's skin; built once for a pair of faces."""

    @property
    def measures(self) -> Mapping[str, float]:
        """Health of the correspondence, for the report."""
        ...

    @property
    def parameters(self) -> Mapping[str, float | str | bool]:
        """What it was built with, for the report."""
        ...

    def apply(self, motions: Floats) -> Floats:
        """(n_source, K, 3) offsets to (n_target, K, 3), mesh units of each face."""
        ...

    def carry(self, values: Floats) -> Floats:
        """(n_source, m) values of any field of the skin to (n_target, m), unscaled."""
        ...


@runtime_checkable
class Anchored(Protocol):
    """A transfer that wants to know what rests before it carries anything."""

    def anchored(self, reach: Floats) -> SkinTransfer:
        """The transfer for motions that move each of the source's vertices by (n_source,) mesh units at most."""
        ...


DEFAULT_BACKEND = "fit"
"""What `clone` uses when nobody chooses."""

Builder = Callable[[PreparedFace, PreparedFace, bool], SkinTransfer]


@dataclass(frozen=True, slots=True)
class Backend:
    """A registered backend.

    Attributes
    ----------
    name : as given to `clone`.
    title : the method in a few words.
    module : import path of the module that offers ``build_transfer(source, target, as_published)``.
    detector : the method's own way to find feature points, for published mode (see `cloning.detect`).
    recast : import path of the module that offers ``build_recast(source, target)``, where the paper's result is not the
        target's own mesh; "" = it is.
    """

    name: str
    title: str
    module: str
    detector: str = "auto"
    recast: str = ""

    def build(self, source: PreparedFace, target: PreparedFace, as_published: bool) -> SkinTransfer:
        """Prepare the transfer between two faces."""
        builder = cast("Builder", import_module(self.module).build_transfer)
        return builder(source, target, as_published)

    def build_published(self, source: PreparedFace, target: PreparedFace) -> tuple[PreparedFace, SkinTransfer]:
        """Prepare the paper's own transfer, and the face that it moves: the target, or what the paper makes of it."""
        if not self.recast:
            return target, self.build(source, target, True)
        recast = cast("Callable[..., tuple[PreparedFace, SkinTransfer]]", import_module(self.recast).build_recast)
        return recast(source, target)


_BACKENDS: dict[str, Backend] = {}


def register_backend(entry: Backend) -> None:
    """Add a backend; a later one of the same name replaces an earlier one."""
    _BACKENDS[entry.name] = entry


def backends() -> tuple[Backend, ...]:
    """All registered backends."""
    return tuple(_BACKENDS.values())


def find_backend(name: str) -> Backend:
    """Return the backend of this name.

    Raises
    ------
    CloningError
        If there is none.
    """
    if name not in _BACKENDS:
        raise CloningError(f"there is no backend '{name}'; choose one of: {', '.join(_BACKENDS)}")
    return _BACKENDS[name]


RECAST = "cloning.recast"

register_backend(Backend("fit", "elastic template and FAPU-scaled displacements", "cloning.fit"))
register_backend(Backend("dt", "elastic template and deformation transfer (Xiang et al. 2008)", "cloning.dt", "xiang"))
register_backend(Backend("fmc", "Facial Motion Cloning (Pandzic 2001)", "cloning.fmc"))
register_backend(Backend("vtc", "elastic template and vertex tents (Song et al.)", "cloning.vtc", recast=RECAST))
register_backend(Backend("vtc-image", "mesh image and vertex tents (Song et al.)", "cloning.vtc_image", recast=RECAST))
register_backend(Backend("ec", "Expression Cloning (Noh and Neumann 2001)", "cloning.ec"))
