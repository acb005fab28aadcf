"""Logs of a controller's ticks, made in memory by the same C code that runs in the process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from leeway_lcm import leeway as wire
from log_maker import event, hull, obstacles, scene, stamp

from leeway import _native

PLANT, CONTROLLER = 1 << 40 | 11, 1 << 41 | 22
START_NS, PERIOD_NS = 5_000_000_000, 8_000_000
SCENE = """
robot: ur5
rate_hz: 125
duration_s: 2
q0: [0, -1.2, 1.6, -0.4, 0.3, 0]
limits: {velocity: [1, 1, 1, 1, 1, 1], acceleration: [4, 4, 4, 4, 4, 4]}
law: {attraction: cone, rho_rep: 1.9}
request: {goal: [0.5, -0.6, 0.5]}
"""
Item = tuple[int, tuple[float, float, float], float]
Messages = list[tuple[str, bytes]]  # channel, data


class Recorder:
    """A controller and its plant; whatever they exchange is heard, logged, or both."""

    def __init__(self, session: int = CONTROLLER, log: Messages | None = None) -> None:
        self.log: Messages = [] if log is None else log
        self.session = session
        self.controller = _native.Controller(_native.read_scene(SCENE, "test", []), session)
        self.world = _native.World()
        self.command: Any = None
        self.state: Any = None
        self.now = START_NS
        self.seq = 0
        self.announce()

    def send(self, channel: str, message: Any) -> bytes:
        """Log a message."""
        data = bytes(message.encode())
        self.log.append((channel, data))
        return data

    def announce(self) -> None:
        """Log a SCENE."""
        self.send("SCENE", scene(self.session, yaml=SCENE, build=_native.BUILD))

    def obstacles(self, sender: int, seq: int, items: list[Item], **how: bool) -> bytes:
        """Send OBSTACLES (upsert); `heard` by the controller, `logged`: both unless said."""
        message = obstacles(sender, seq, wire.obstacles_t.UPSERT, items)
        data = bytes(message.encode())
        if how.get("heard", True):
            assert self.world.apply(data)
        if how.get("logged", True):
            self.log.append(("OBSTACLES", data))
        return data

    def hull(self, sender: int, seq: int, number: int, count: int = 8) -> bytes:
        """Send HULL, moving and with a time; heard and logged."""
        vertices = [(0.05 * (k % 2), 0.05 * (k // 2 % 2), 0.05 * (k // 4)) for k in range(count)]
        m = hull(sender, seq, number, (0.5, -0.6, 0.4), vertices)
        m.time_ns, m.valid_for_ms = self.now, 1000
        m.o.v, m.o.omega = [0.1, 0.0, 0.0], [0.0, 0.0, 0.5]
        data = bytes(m.encode())
        assert self.world.apply(data, True)
        self.log.append(("HULL", data))
        return data

    def request(self, sender: int, seq: int, goal: tuple[float, float, float] | None) -> None:
        """Send GOAL, or STOP for None."""
        message = wire.stop_t() if goal is None else wire.goal_t()
        if goal is not None:
            message.p = list(goal)
        name = "STOP" if goal is None else "GOAL"
        data = self.send(name, stamp(message, sender, seq, self.now))
        assert self.controller.request(data, goal is None)

    def move(self) -> None:
        """Let the plant obey the last command and publish its state."""
        m = stamp(wire.joint_state_t(), PLANT, 1, self.now - PERIOD_NS // 2)
        m.period_ns = PERIOD_NS
        m.q = [0.0, -1.2, 1.6, -0.4, 0.3, 0.0]
        if self.state is not None:
            m.h.seq = self.state.h.seq + 1
            m.tick, m.q = self.state.tick, list(self.state.q)
        if self.command is not None and self.command.mode:
            m.plant_mode, m.tick = 1, m.tick + 1
            m.command_session, m.command_seq = self.session, self.seq
            m.qd = list(self.command.qd)
            m.q = [q + qd * PERIOD_NS * 1e-9 for q, qd in zip(m.q, m.qd, strict=True)]
        self.state = m
        self.controller.joint_state(self.send("JOINT_STATE", m))

    def tick(self, count: int = 1, moves: bool = True, warming_up: bool = False) -> None:
        """Send commands."""
        for _ in range(count):
            if moves:
                self.move()
            age = self.now - self.state.h.mono_ns if self.state else self.now
            data = self.controller.tick(self.now, age, warming_up, self.world)
            self.command = wire.joint_command_t.decode(data)
            self.repeat()
            self.now += PERIOD_NS

    def repeat(self) -> None:
        """Send the last command, once more."""
        self.seq += 1
        stamp(self.command, self.session, self.seq, self.now)
        self.command.compute_ns, self.command.skipped = 1000 + self.seq, self.seq // 7
        self.send("JOINT_COMMAND", self.command)


def write(log: Messages, path: Path) -> Path:
    """Write a log and return its path."""
    path.write_bytes(b"".join(event(name, data, k) for k, (name, data) in enumerate(log)))
    return path


def places(log: Messages, channel: str) -> list[int]:
    """Return where the messages of a channel are in a log."""
    return [k for k, (name, _) in enumerate(log) if name == channel]


def usual() -> Messages:
    """Return a log with everything in it: waiting, warming up, obstacles, goal, stop, the end."""
    r = Recorder()
    r.tick(2, moves=False)
    r.tick(2, warming_up=True)
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1), (2, (0.2, 0.6, 0.3), 0.0)])
    r.tick(12)
    r.obstacles(8, 1, [(3, (0.3, -0.6, 0.7), 0.05)])
    r.obstacles(7, 2, [(1, (0.5, -0.5, 0.5), 0.1)])
    r.tick(8)
    r.request(9, 1, (0.4, -0.5, 0.4))
    r.tick(8)
    r.request(9, 1, None)
    r.tick(6)
    r.request(9, 2, (0.3, -0.6, 0.3))
    r.tick(6)
    r.controller.shutdown()
    r.tick(6)
    return r.log
