"""Playback of a synthetic face of 20,000 vertices, beside a plain loop: ``python -m benchmarks.report.player``."""

from __future__ import annotations

import json

import numpy as np

from benchmarks.playback import full_stream, plain_frame, speech_stream, synthetic_face
from benchmarks.report.processes import seconds
from fat import AnimatableFace
from fat.evaluate import Player
from fba import FapStream

VERTICES = 20_000
FRAMES = 512
PLAIN = 10
"""Frames of the plain loop."""


def main() -> None:
    found = {}
    for dense in (False, True):
        face = synthetic_face(VERTICES, dense)
        share = np.mean([m.coord_index.size / face.scene.vertex_count for t in face.tables for m in t.meshes])
        found[f"a table moves {100 * share:.0f} % of the vertices"] = speeds(face)
    print(json.dumps(found))


def speeds(face: AnimatableFace) -> dict[str, float]:
    """Frames per second of processor time."""
    player, summed = Player(face), Player(face, rules=())
    still, turning = full_stream(FRAMES, head=False), full_stream(FRAMES, head=True)
    found = {
        "head turning": played(player, turning),
        "head at rest": played(player, still),
        "head at rest, 4-byte numbers": played(player, still, single=True),
        "speech": played(player, speech_stream(FRAMES)),
        "by the plain sum": played(summed, still),
    }
    plain = full_stream(PLAIN, head=False)
    loop = seconds(lambda: [plain_frame(face, plain, k) for k in range(PLAIN)], 2)
    return {**found, "plain loop": PLAIN / loop}


def played(player: Player, stream: FapStream, single: bool = False) -> float:
    """Frames per second of processor time, once the player is set up."""

    def work() -> None:
        for _ in player.world_frames(stream, single=True) if single else player.world_frames(stream):
            pass

    work()
    return len(stream) / seconds(work, 3)


if __name__ == "__main__":
    main()
