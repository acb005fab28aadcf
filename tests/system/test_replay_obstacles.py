"""Logs with obstacles of every shape that move and expire, computed again: every bit equal."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from helpers import Listener, read, running
from leeway_lcm import leeway as wire
from test_replay import recorded, ticks_in, verify

from leeway import bus

PACE = 5  # ticks of 2 ms from sample to sample: a silence of 20 samples outlasts what was told

pytestmark = pytest.mark.usefixtures("private_network")


class Source:
    """A sensor whose obstacles, one of each shape, move, turn and expire."""

    def __init__(self, listener: Listener, first: int) -> None:
        self._bus, self._first = listener.bus, first
        self._session, self._seq = bus.new_session(), Counter[str]()

    def _send(self, channel: str, message: Any) -> None:
        self._seq[channel] += 1
        message.h = bus.header(self._session, self._seq[channel])
        message.time_ns, message.valid_for_ms = message.h.mono_ns, 150
        self._bus.publish(channel, message.encode())

    def tell(self, k: int) -> None:
        """Tell the k-th sample: hulls anew each tenth time, else moved by their ids."""
        m = wire.obstacles_t()
        m.op, m.n = m.REPLACE if k % 3 else m.UPSERT, 5
        for shape in range(m.n):
            o = m.o[shape]
            o.id, o.shape, o.radius = self._first + shape, shape, 0.05
            o.p = [0.9, 0.1 * shape - 0.3, 0.3 + 0.01 * (k % 50)]
            o.quat, o.size = [0.6, 0.0, 0.8, 0.0], [0.05, 0.1, 0.15]
            o.v, o.omega = [0.0, 0.0, 0.5], [0.0, 0.1 * shape, 0.0]
        m.o[4].p = [0.0, 0.0, -1.0 - 0.01 * (k % 7)]
        if k % 10 == 0:
            h = wire.hull_t()
            h.o, h.n = m.o[3], 8 + k % 7
            h.vertex[: h.n] = [[0.05 * (i % 2), 0.05 * (i // 2), 0.01 * i * k] for i in range(h.n)]
            self._send("HULL", h)
        self._send("OBSTACLES", m)


def test_moving_expiring_shapes_of_several_sources_are_equal(root: Path, tmp_path: Path) -> None:
    scene, log = root / "scenarios" / "moving_box.yaml", tmp_path / "run.lcm"
    listener = Listener()
    with (
        recorded(log),
        running("leeway-simulator", scene, "-q"),
        running("leeway-controller", scene, "-q"),
    ):
        sources = [Source(listener, 100 * n) for n in (1, 2, 3)]
        first = listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
        for k in range(120):
            for source in sources:
                if (k // 20) % 3 != sources.index(source):  # each is silent for a while
                    source.tell(k)
            due = first.tick + k * PACE
            listener.wait_for("JOINT_COMMAND", lambda c, due=due: c.tick >= due)
    status, found = verify(log)
    (c,) = found["controllers"]
    assert (status, found["result"], c["differing"]) == (0, "equal", 0)
    assert c["equal"] == ticks_in(log) > 200
    commands = read(log, "JOINT_COMMAND")
    assert len({c.obstacle_count for c in commands}) > 3  # obstacles came and expired
    heard = {(m.world_channel, m.world_session) for m in commands}
    assert len({session for _, session in heard}) >= 4
    assert {channel for channel, _ in heard} >= {1, 2}
