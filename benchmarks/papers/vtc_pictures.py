"""Song et al., vertex tents in pictures: figures 12 to 15 and the timing, beside expression ratio images."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from benchmarks.analogy import (
    LEFT,
    LIGHTS,
    SHOWN,
    TARGETS,
    WHOLE,
    Seconds,
    Transfer,
    itself_sheet,
    means,
    onto_clone,
    onto_itself,
    reduced,
    run,
    seconds,
    studio,
)
from benchmarks.image_errors import Errors
from benchmarks.papers.pictures import save
from cloning.image import METHODS
from studio.sheet import Sheet

SHRINK = 2
SAME, RELIT = "same light", tuple(light for light in LIGHTS if light != "same light")
JOY = "joy"
OPEN = "surprise"


def reproduce_pictures(images: Path, tell: Callable[[str], None]) -> dict[str, str]:
    """Draw the figures into a folder; the tables, by the name of their place in the page."""
    tell("figures 12 and 14")
    transfers = {(name, light): onto_clone(name, light) for name in TARGETS for light in LIGHTS}
    save(onto_others({name: transfers[name, SAME] for name in TARGETS}).image(), images / "vtc_12_onto_others.png")
    save(in_other_light({light: transfers[TARGETS[0], light] for light in RELIT}).image(), images / "vtc_14_eri.png")
    tell("figure 13")
    save(opened_mouth().image(), images / "vtc_13_opened_mouth.png")
    tell("figure 15")
    own = onto_itself()
    save(itself_sheet(own, SHRINK).image(), images / "vtc_15_onto_itself.png")
    tell("timing of pictures")
    return {"vtc-14": truth_table(transfers), "vtc-15": itself_table(own), "vtc-2d": speed_table(seconds())}


def onto_others(transfers: Mapping[str, Sequence[Transfer]]) -> Sheet:
    """Figure 12: expressions of the source on other faces, beside the truth."""
    sheet = Sheet()
    for rows in zip(*transfers.values(), strict=True):
        pose = rows[0].pose
        if pose in SHOWN:
            shown = [rows[0].expression, *(rgb for t in rows for rgb in (t.made["vtc"], t.goal))]
            captions = ("source", *(f"{name}{what}" for name in transfers for what in ("", ", truth")))
            sheet.add_row(pose, [reduced(rgb, SHRINK) for rgb in shown], captions if pose == SHOWN[-1] else ())
    return sheet


def in_other_light(transfers: Mapping[str, Sequence[Transfer]]) -> Sheet:
    """Figure 14: ratio images beside tents, with the target or the source's expression in another light."""
    sheet = Sheet()
    for light, found in transfers.items():
        (t,) = (t for t in found if t.pose == JOY)
        shown = (t.expression, t.target, t.made["eri"], t.made["vtc"], t.goal)
        captions = ("source", "target", "ERI", "VTC", "truth") if light == list(transfers)[-1] else ()
        sheet.add_row(light, [reduced(rgb, SHRINK) for rgb in shown], captions)
    return sheet


def opened_mouth() -> Sheet:
    """Figure 13: a mouth that opens, as the paper leaves it and with the source's mouth shown in it."""
    sheet, own = Sheet(), studio("source")
    neutral, expression = own.shoot("neutral"), own.shoot(OPEN)
    for name in TARGETS:
        other = studio(name)
        target = other.shoot("neutral")
        made = [run(neutral, expression, target, "vtc", teeth).rgb for teeth in (False, True)]
        shown = [expression.rgb, target.rgb, *made, other.shoot(OPEN).rgb]
        captions = ("source", "target", "the paper's result", "with the source's mouth", "truth")
        sheet.add_row(name, [reduced(rgb, SHRINK) for rgb in shown], captions if name == TARGETS[-1] else ())
    return sheet


def truth_table(transfers: Mapping[tuple[str, str], Sequence[Transfer]]) -> str:
    """Errors against the rendered truth for each target and light."""
    lines = ["| target | light | left as it is | ERI | VTC | VTC, whole picture |", "|---|---|---|---|---|---|"]
    for (name, light), found in transfers.items():
        mean = means(found)
        lines.append(f"| {name} | {light} | " + " | ".join(cell(mean[k]) for k in (LEFT, "eri", "vtc", WHOLE)) + " |")
    return "\n".join(lines) + "\n"


def itself_table(transfers: Sequence[Transfer]) -> str:
    """Errors of the source given its own expressions."""
    lines = ["| | " + " | ".join(t.pose for t in transfers) + " |", "|---" * (len(transfers) + 1) + "|"]
    for m in reversed(METHODS):
        lines.append(f"| {m.upper()} | " + " | ".join(cell(t.found[m]) for t in transfers) + " |")
    return "\n".join(lines) + "\n"


def speed_table(taken: Mapping[str, Seconds]) -> str:
    """Seconds of the processor."""
    lines = ["| | ERI | VTC |", "|---|---|---|"]
    both = [taken[m] for m in reversed(METHODS)]
    lines.append("| pixels in the mask | " + " | ".join(f"{t.unknowns:,}" for t in both) + " |")
    lines.append("| set-up and first expression, s | " + " | ".join(f"{t.first:.2f}" for t in both) + " |")
    lines.append("| each further expression, s | " + " | ".join(f"{t.further:.3f}" for t in both) + " |")
    return "\n".join(lines) + "\n"


def cell(found: Errors) -> str:
    """Mean absolute error in levels, PSNR in dB, SSIM."""
    return f"{found.mean:.2f} / {found.psnr:.2f} / {found.ssim:.3f}"
