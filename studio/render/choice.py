"""Which renderer this machine gets."""

from __future__ import annotations

import os
from typing import Literal

from fba.errors import MissingDependencyError
from studio.render.egl import EglRenderer
from studio.render.protocol import Renderer, RendererError
from studio.render.software import SoftwareRenderer

Preference = Literal["auto", "egl", "software"]
ENVIRONMENT = "FBA_RENDERER"


def make_renderer(prefer: Preference | str = "auto") -> Renderer:
    """Choose a renderer.

    Parameters
    ----------
    prefer : "software" (numpy, works everywhere), "egl" (moderngl without a display, faster), or "auto": egl where
        it works, else software; `name` says which and why. The environment variable FBA_RENDERER, when set,
        decides instead.

    Raises
    ------
    RendererError
        If "egl" is wanted and does not work here, or the name is unknown.
    MissingDependencyError
        If "egl" is wanted and moderngl is not installed.
    """
    wanted = os.environ.get(ENVIRONMENT, "").strip().lower() or prefer
    if wanted not in ("auto", "egl", "software"):
        raise RendererError(f"there is no renderer '{wanted}'; choose auto, egl or software (also in {ENVIRONMENT})")
    if wanted == "software":
        return SoftwareRenderer()
    try:
        return EglRenderer()
    except (MissingDependencyError, RendererError) as error:
        if wanted == "egl":
            raise
        reason = "moderngl is not installed" if isinstance(error, MissingDependencyError) else "EGL does not work here"
        return SoftwareRenderer(f"software ({reason})")
