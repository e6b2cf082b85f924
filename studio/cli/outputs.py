"""Where verbs write: refused early where it could only fail, or would overwrite another file of the same call."""

from __future__ import annotations

from pathlib import Path

from studio.cli.outcome import usage


def check_outputs(
    output: Path,
    report: Path | None,
    sheet: Path | None,
    inputs: tuple[Path | None, ...],
    chessboard: Path | None = None,
) -> None:
    """Refuse what could only fail, or overwrite another file of the same call, after minutes of work."""
    from formats.files import require_folder

    if sheet is not None and sheet.suffix.lower() != ".png":
        usage(f"--sheet {sheet}: the contact sheet is a .png")
    if chessboard is not None and chessboard.suffix.lower() != ".png":
        usage(f"--map {chessboard}: the picture of the map is a .png")
    taken = {path.absolute() for path in inputs if path is not None}
    for option, path in (("--report", report), ("--sheet", sheet), ("--map", chessboard)):
        if path is not None and path.absolute() in {*taken, output.absolute()}:
            usage(f"{option} {path}: this call reads or writes that file already; choose another name")
        if path is not None:
            taken.add(path.absolute())
    for path in (output, report, sheet, chessboard):
        if path is not None:
            require_folder(path)
