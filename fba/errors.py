"""One base error, with children named after the user's mistake.

Every message says what is wrong, where, and what to do about it. A library function raises; only the
command line turns an error into an exit code.
"""

from __future__ import annotations


class FbaError(Exception):
    """Base of every error that this toolkit raises on purpose."""


class InputFileError(FbaError):
    """A file cannot be read: missing, empty, cut, or not what its name says."""


class OutputFileError(FbaError):
    """A file cannot be written; an existing file of that name is untouched."""


class UnknownFormatError(FbaError):
    """No reader or writer is registered for this file name."""


class UnsupportedFeatureError(FbaError):
    """The file or request is understood, but this toolkit or format cannot carry it."""


class MeshError(FbaError):
    """A mesh is unusable: no faces, indices out of range, NaN vertices."""


class LandmarkError(FbaError):
    """Feature points are missing, off the surface, or contradict each other."""


class FaceDefTablesError(FbaError):
    """Face animation tables contradict themselves or the scene graph they refer to."""


class FapStreamError(FbaError):
    """A FAP stream is damaged; the message names the line or frame."""


class CloningError(FbaError):
    """Motion cannot be cloned between these two faces."""


class MissingDependencyError(FbaError):
    """An optional part is not installed; the message names the extra that adds it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package '{package}'. Install it with: pip install 'fba-toolkit[{extra}]'"
        )
        self.package = package
        self.extra = extra


class TextSyntaxError(InputFileError):
    """A text format breaks its grammar at a known line and column (both counted from 1)."""

    def __init__(self, message: str, line: int, column: int, source: str = "") -> None:
        where = f"{source}:" if source else ""
        super().__init__(f"{where}line {line}, column {column}: {message}")
        self.line = line
        self.column = column


class VrmlSyntaxError(TextSyntaxError):
    """VRML97 or BT text breaks the grammar."""
