"""What a coded stream does not carry as it is, as findings."""

from __future__ import annotations

from fba.faps import fap
from fba.findings import Finding
from fba.stream import FapStream
from formats.fba_bitstream.encoder import Encoder
from formats.fba_bitstream.rates import coded_rate, rate_of
from formats.fba_bitstream.syntax import LARGEST_RANGE


def lossy_findings(encoder: Encoder, stream: FapStream, quantizer: int) -> list[Finding]:
    """What is rounded and cut."""
    found = []
    if encoder.rounded:
        text = f"values are rounded to steps of the scale {quantizer}, off by up to: {fap_list(encoder.rounded)}"
        found.append(Finding("warning", "fap-rounded", text))
    if encoder.clipped:
        text = f"values beyond what can be coded are cut, off by up to: {fap_list(encoder.clipped)}"
        found.append(Finding("warning", "fap-clipped", text))
    return [*found, *frame_findings(stream)]


def correction_findings(unquantized: Encoder, encoder: Encoder, stream: FapStream) -> list[Finding]:
    """What the values alone do not carry, but corrections in user data do.

    unquantized : the attempt at scale 0, which says the FAPs that do not fit.
    """
    off = dict(encoder.rounded)
    for fap_id, amount in encoder.clipped.items():
        off[fap_id] = max(amount, off.get(fap_id, 0))
    text = (
        f"values that begin beyond {LARGEST_RANGE}, or change by more in a frame, cannot be sent as they are; too "
        f"large by: {fap_list(unquantized.clipped)}. Values are rounded and what is missing stands in user data, "
        "which this toolkit reads" + (f"; other decoders are off by up to: {fap_list(off)}" if off else "")
    )
    return [Finding("info", "fap-corrections", text), *frame_findings(stream)]


def frame_findings(stream: FapStream) -> list[Finding]:
    """What becomes of the frame rate and of the frames' numbers."""
    found = []
    written = rate_of(*coded_rate(stream.frame_rate))
    if abs(written - stream.frame_rate) > 1e-4 * stream.frame_rate:
        text = f"{stream.frame_rate:g} frames a second become {written:g}, the nearest that can be coded"
        found.append(Finding("warning", "frame-rate", text))
    if int(stream.frame_numbers[0]) < 0:
        text = f"frames are counted from 0 instead of {int(stream.frame_numbers[0])}"
        found.append(Finding("info", "frame-numbers", text))
    return found


def fap_list(amounts: dict[int, int]) -> str:
    """``head_pitch (84), ...``: the largest amounts first, the rest as a number."""
    order = sorted(amounts, key=lambda k: (-amounts[k], k))
    text = ", ".join(f"{fap(k).name} ({amounts[k]})" for k in order[:4])
    return text + (f" and {len(order) - 4} more" if len(order) > 4 else "")
