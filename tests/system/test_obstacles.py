"""Obstacles over the bus: every shape by command, bad ones refused and counted, full worlds."""

from __future__ import annotations

import contextlib
import json
import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
from helpers import Listener, leeway, running
from leeway_lcm import leeway as wire

from leeway.bus import header, new_session
from leeway.status import REASONS

pytestmark = pytest.mark.usefixtures("private_network")

UNIT = [1.0, 0.0, 0.0, 0.0]
WORLD_MAX, OWN = 10_000, 1  # obstacles; those of the scene's own sensor


@pytest.fixture
def controller(root: Any) -> Iterator[Listener]:
    """A controller beside a simulator whose sensor sees one ball; what is heard of them."""
    scene = root / "scenarios" / "reach.yaml"
    with running("leeway-simulator", scene, "-q"), running("leeway-controller", scene, "-q"):
        listener = Listener()
        listener.wait_for("STATUS", lambda s: s.state == s.RUNNING and s.obstacle_count == OWN)
        yield listener


class Source:
    """A sensor that may send anything."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self.session = new_session()
        self._seq: Counter[str] = Counter()

    def send(self, message: Any) -> tuple[int, int]:
        """Stamp and send a message; return its channel, as commands name it, and number."""
        channel = "HULL" if isinstance(message, wire.hull_t) else "OBSTACLES"
        self._seq[channel] += 1
        message.h = header(self.session, self._seq[channel])
        self._listener.bus.publish(channel, message.encode())
        return getattr(wire.joint_command_t, channel), self._seq[channel]

    def heard(self, message: Any) -> Any:
        """Send a message until a command has seen it; return that command."""
        channel, seq = self.send(message)
        name = "HULL" if isinstance(message, wire.hull_t) else "OBSTACLES"
        expected = (channel, self.session, seq)

        def is_echo(c: Any) -> bool:
            return bool((c.world_channel, c.world_session, c.world_seq) == expected)

        for _ in range(30):
            with contextlib.suppress(AssertionError):  # another source was heard since
                return self._listener.wait_for("JOINT_COMMAND", is_echo, seconds=0.3)
            self._listener.bus.publish(name, message.encode())
        raise AssertionError(f"{name} {seq}: no echo")


def balls(*numbers: int, op: int = 0, **fields: Any) -> Any:
    """Return an obstacles_t of small balls far away."""
    m = wire.obstacles_t()
    m.op, m.n = op, len(numbers)
    for slot, number in zip(m.o, numbers, strict=False):
        slot.id, slot.p, slot.quat, slot.radius = number, [3.0, 3.0, 0.001 * number], UNIT, 0.01
    for name, value in fields.items():
        setattr(m, name, value)
    return m


def hull(number: int, vertices: list[list[float]], n: int | None = None) -> Any:
    m = wire.hull_t()
    m.o.id, m.o.shape, m.o.p, m.o.quat = number, m.o.HULL, [3.0, -3.0, 1.0], UNIT
    m.vertex[: len(vertices)] = vertices
    m.n = len(vertices) if n is None else n
    return m


def changed(message: Any, **fields: Any) -> Any:
    """Change the first obstacle of a message."""
    for name, value in fields.items():
        setattr(message.o[0], name, value)
    return message


# --- by command ---


def listed(*arguments: object) -> dict[int, Any]:
    result = leeway("obstacle", "list", "--json", *arguments)
    assert result.returncode == 0, result.stderr
    return {o["id"]: o for o in json.loads(result.stdout)["obstacles"]}


ADDED = {
    5: ("--radius", 0.1),
    6: ("box", "--size", 0.1, 0.2, 0.4, "--rpy", 0, 0, "90deg", "--velocity", 0, 0.1, 0),
    7: ("hull", "--vertices", "0,0,0 0.1,0,0 0,0.1,0 0,0,0.1", "--radius", 0.01),
    8: ("plane", "--normal", 1, 0, 0, "--for", "50s"),
    9: ("capsule", "--length", 0.4, "--radius", 0.05),
}


def test_every_shape_by_command(controller: Listener) -> None:
    for number, words in ADDED.items():
        result = leeway("obstacle", "add", *words, "--at", -3, number, 1, "--id", number)
        assert result.returncode == 0, result.stderr
    found = listed()
    assert sorted(found) == [1, *ADDED]
    shapes = {number: found[number]["shape"] for number in ADDED}
    assert list(shapes.values()) == ["sphere", "box", "hull", "plane", "capsule"]
    assert found[6]["size"] == pytest.approx([0.05, 0.1, 0.2])
    assert found[6]["quat"] == pytest.approx([math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    assert found[6]["v"] == [0, 0.1, 0]
    assert 0 < found[6]["age_s"] < 10
    assert found[7]["vertices"][1] == [0.1, 0, 0]
    assert found[8]["quat"] == pytest.approx([math.sqrt(0.5), 0, math.sqrt(0.5), 0])
    assert (found[8]["expires_ns"] - found[8]["time_ns"]) / 1e9 == pytest.approx(50)
    assert len({o["owner"] for o in found.values()}) == 6
    # Moved, a hull and a box keep what they are.
    for number in (6, 7):
        assert leeway("obstacle", "move", number, "--at", -3, 0, 1.5).returncode == 0
    after = listed()
    for number in (6, 7):
        for name in ("shape", "size", "quat", "radius", "vertices"):
            assert after[number][name] == found[number][name]
        assert after[number]["p"] == [-3, 0, 1.5]
    assert leeway("obstacle", "remove", 7).returncode == 0
    assert leeway("obstacle", "move", 7, "--at", 0, 0, 2).returncode == 1
    text = leeway("obstacle", "list").stdout
    for words in ("box", "plane", "capsule", "0 0 90 deg"):
        assert words in " ".join(text.split())
    assert leeway("obstacle", "clear").returncode == 0
    controller.wait_for("STATUS", lambda s: s.obstacle_count <= OWN)


def test_what_expires_is_gone(controller: Listener) -> None:
    args = ("obstacle", "add", "--at", 3, 3, 1, "--id", 70, "--for", "2s", "--json")
    result = leeway(*args)
    assert json.loads(result.stdout)["obstacles"] == OWN + 1, result.stderr
    controller.wait_for("STATUS", lambda s: s.obstacle_count == OWN + 1)
    controller.wait_for("STATUS", lambda s: s.obstacle_count == OWN, seconds=5)
    assert 70 not in listed()


WRONG = [
    (("box",), 2, "needs --size"),
    (("box", "--size", 1, 0, 1), 2, "three edges > 0"),
    (("box", "--size", 1, 1, 1, "--length", 1), 2, "no --length"),
    (("--size", 1, 1, 1), 2, "a sphere has no --size"),
    (("hull",), 2, "needs --vertices"),
    (("hull", "--vertices", " ".join(["0,0,0"] * 65)), 2, "1 to 64 points"),
    (("hull", "--vertices", "0,0 1,1"), 2, "x,y,z"),
    (("plane", "--normal", 0, 0, 0), 2, "a direction"),
    (("plane", "--normal", 0, 0, 1, "--rpy", 0, 0, 1), 2, "not both"),
    (("--rpy", 1, 2, "3grad"), 2, "30deg"),
    (("--for", "soon"), 2, "500ms"),
    (("--velocity", 0, 0, 101), 2, "velocity"),
    (("--radius", "nan"), 2, "radius"),
    (("ball",), 2, "ball"),
    (("--for", "1s"), 1, "no controller answered"),
    (("box", "--size", 1, 1, 1), 1, "no controller answered"),
]


@pytest.mark.parametrize(("words", "status", "text"), WRONG)
def test_wrong_words_get_one_message(words: Any, status: int, text: str) -> None:
    result = leeway("obstacle", "add", "--at", 1, 1, 1, *words)
    assert (result.returncode, result.stdout) == (status, "")
    assert "Traceback" not in result.stderr
    assert text in " ".join(result.stderr.replace("│", " ").split())


def test_nobody_tells_a_list() -> None:
    result = leeway("obstacle", "list")
    assert result.returncode == 1
    assert "no controller tells its obstacles" in result.stderr


# --- over the bus ---

NAN, FAR = math.nan, 1e9
BAD: dict[str, tuple[Any, str]] = {
    "NaN in its place": (changed(balls(50), p=[NAN, 0.0, 0.0]), "NO_NUMBER"),
    "infinite velocity": (changed(balls(50), v=[0.0, math.inf, 0.0]), "NO_NUMBER"),
    "zero quaternion": (changed(balls(50), quat=[0.0] * 4), "RANGE"),
    "quaternion of length 1.01": (changed(balls(50), quat=[1.01, 0.0, 0.0, 0.0]), "RANGE"),
    "negative radius": (changed(balls(50), radius=-0.01), "RANGE"),
    "1e9 m away": (changed(balls(50), p=[0.0, FAR, 0.0]), "RANGE"),
    "no such shape": (changed(balls(50), shape=5), "RANGE"),
    "box without size": (changed(balls(50), shape=2), "RANGE"),
    "id 0": (balls(0), "RANGE"),
    "an id twice": (balls(50, 51, 50), "RANGE"),
    "33 entries": (balls(50, n=33), "RANGE"),
    "an expiry without a time": (balls(50, valid_for_ms=100), "RANGE"),
    "a time before time": (balls(50, time_ns=-1), "RANGE"),
    "a hull nobody told": (changed(balls(50, 51), shape=3), "UNKNOWN"),
    "a hull of 65 vertices": (hull(50, [[0.0, 0.0, 0.1]] * 64, n=65), "RANGE"),
    "a hull of none": (hull(50, []), "RANGE"),
    "a vertex that is no number": (hull(50, [[0.0, NAN, 0.0]]), "NO_NUMBER"),
}


def test_bad_obstacles_are_refused_and_counted(controller: Listener) -> None:
    bad, good = Source(controller), Source(controller)
    good.heard(balls(40, 41))
    before = controller.wait_for("STATUS", lambda _: True)
    expected: Counter[str] = Counter()
    for message, reason in BAD.values():
        bad.send(message)
        expected[reason] += 1

    def refused(s: Any) -> Counter[str]:
        counts = {r: getattr(wire.status_t, r) for r in REASONS}
        return Counter({r: s.refused[k] - before.refused[k] for r, k in counts.items()})

    last = controller.wait_for("STATUS", lambda s: refused(s).total() >= len(BAD))
    assert +refused(last) == expected
    assert last.obstacle_count == OWN + 2
    # The good source is heard as before, and the bad one once it sends sense; each of its own.
    assert good.heard(balls(40, 42)).obstacle_count == OWN + 3
    assert bad.heard(balls(50)).obstacle_count == OWN + 4
    assert bad.heard(balls(op=2)).obstacle_count == OWN + 3


ODD = {
    "flat": [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]],
    "a line": [[0.0, 0.0, 0.1 * k] for k in range(5)],
    "one point many times": [[0.1, 0.2, 0.3]] * 64,
    "a point": [[0.0, 0.0, 0.0]],
}


def test_odd_hulls_are_hulls(controller: Listener) -> None:
    source = Source(controller)
    for number, vertices in enumerate(ODD.values(), start=60):
        command = source.heard(hull(number, vertices))
        assert command.obstacle_count == OWN + number - 59
        assert math.isfinite(command.clearance)


def test_the_last_sender_owns_an_id(controller: Listener) -> None:
    first, second = Source(controller), Source(controller)
    first.heard(hull(80, ODD["flat"]))
    first.heard(balls(81))
    moved = changed(balls(80, 81), shape=3)
    assert second.heard(moved).obstacle_count == OWN + 2
    owners = {n: o["owner"] for n, o in listed().items() if n in (80, 81)}
    assert set(owners.values()) == {second.session}
    assert first.heard(balls(82, op=2)).obstacle_count == OWN + 3  # drops nothing of the other's
    assert second.heard(balls(op=2)).obstacle_count == OWN + 1


def test_the_ten_thousand_and_first_is_refused(controller: Listener) -> None:
    source = Source(controller)
    before = controller.wait_for("STATUS", lambda s: s.ticks > 300)
    numbers = range(1001, 1001 + WORLD_MAX - OWN)
    for some in (numbers[k : k + 512] for k in range(0, len(numbers), 512)):
        for k in range(0, len(some), 32):
            source.send(balls(*some[k : k + 32]))
        # A burst of all would not fit into the receive buffer of every system.
        expected = some[-1] - 1000 + OWN
        controller.wait_for("JOINT_COMMAND", lambda c, n=expected: c.obstacle_count == n)
    full = controller.wait_for("STATUS", lambda s: s.obstacle_count == WORLD_MAX, seconds=10)
    source.send(balls(2, 1001))
    said = controller.wait_for("STATUS", lambda s: s.refused[s.FULL] == 1)
    assert said.obstacle_count == WORLD_MAX
    assert source.heard(balls(1001)).obstacle_count == WORLD_MAX  # one that is there needs no room
    assert len(listed()) == WORLD_MAX
    assert full.skipped - before.skipped <= 5
    assert source.heard(balls(op=2)).obstacle_count == OWN


def test_expiries_by_command_go_by_the_time_of_motion(root: Any) -> None:
    # In lockstep; one by the clock of the wall would never come.
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-controller", scene, "--lockstep", "-q"),
        running("leeway-simulator", scene, "--lockstep", "-q", "--pace=200"),
    ):
        listener = Listener()
        listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
        args = ("obstacle", "add", "--at", 3, 3, 1, "--id", 70, "--for", "300ms", "--json")
        result = leeway(*args)
        assert json.loads(result.stdout)["obstacles"] == OWN + 1, result.stderr
        listener.wait_for("JOINT_COMMAND", lambda c: c.obstacle_count == OWN)
