"""Cloning: make a plain face animatable with the motion of another one."""

from __future__ import annotations

from cloning.backends import Backend, backends, find_backend, register_backend
from cloning.clone import clone, clone_shapes, clone_with_report
from cloning.parts import split_parts
from cloning.report import CloneReport

__all__ = [
    "Backend",
    "CloneReport",
    "backends",
    "clone",
    "clone_shapes",
    "clone_with_report",
    "find_backend",
    "register_backend",
    "split_parts",
]
