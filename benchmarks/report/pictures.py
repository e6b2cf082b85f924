"""The analogy of pictures, 311 x 419: ``python -m benchmarks.report.pictures``."""

from __future__ import annotations

import json
import statistics
from dataclasses import replace

from benchmarks.analogy import EXPRESSIONS, LIGHTS, studio
from benchmarks.report.processes import seconds
from cloning.image import Analogy


def main() -> None:
    own = studio("source")
    other = replace(studio("tri_head"), light=LIGHTS["light from the other side"][0])
    source, target = own.shoot("neutral"), other.shoot("neutral")
    expressions = [own.shoot(pose) for pose in EXPRESSIONS]
    made: list[Analogy] = []

    def set_up() -> None:
        made.append(Analogy(source, target, [p.points for p in expressions]))
        made[0].apply(expressions[0])

    first = seconds(set_up)
    laps = [seconds(lambda p=p: made[0].apply(p)) for p in 2 * expressions]  # type: ignore[misc]
    print(json.dumps({"analogy, set-up": first, "analogy, expression": statistics.median(laps)}))


if __name__ == "__main__":
    main()
