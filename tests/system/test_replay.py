"""Logs of real processes, computed again: every bit equal, every damage found."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lcm
import pytest
from helpers import Listener, leeway, read, running, wait_until
from leeway_lcm import leeway as wire

from leeway import bus
from leeway.connection import Connection
from leeway.processes import Child

pytestmark = pytest.mark.usefixtures("private_network")


def verify(log: Path) -> tuple[int, dict[str, Any]]:
    """Exit status and JSON of `leeway replay --verify`."""
    result = leeway("replay", log, "--verify", "--json")
    assert result.returncode in (0, 1, 3), result.stderr
    return result.returncode, json.loads(result.stdout)


def ticks_in(log: Path) -> int:
    """Number of different ticks commanded in a log, by LCM's own reader."""
    return len({(c.h.session, c.tick) for c in read(log, "JOINT_COMMAND")})


@contextlib.contextmanager
def recorded(log: Path) -> Iterator[Connection]:
    """Record all that happens in the block, to the last message; a bus to speak on."""
    own = bus.open_bus(bus.resolve_url(None))
    mark = f"end of {log.name}".encode()
    logger = Child("lcm-logger", "-q", "-f", str(log), ahead=True)

    def has(text: bytes) -> bool:
        own.publish("LCM_SELF_TEST", text)
        return log.exists() and text in log.read_bytes()[-(1 << 16) :]

    try:
        wait_until(lambda: has(b"begin"), 10, "logger")
        yield own
        wait_until(lambda: has(mark), 10, "mark in the log")
    finally:
        logger.stop()


def record_by_hand(root: Path, log: Path) -> None:
    """A live run in which somebody moves an obstacle and changes the goal."""
    scene = root / "scenarios" / "c4.yaml"
    listener = Listener()
    with recorded(log) as own, running("leeway-simulator", scene):
        with running("leeway-controller", scene):
            listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
            for k in range(3):
                entry = (77, (-0.4, 0.5 + 0.1 * k, 0.4), 0.1)
                assert bus.send_obstacles(own, None, bus.UPSERT, [entry]) is not None
            assert bus.send_goal(own, None, (0.4, -0.5, 0.4)) is not None
            last = listener.wait_for("JOINT_COMMAND", lambda c: c.goal[0] == 0.4)
            listener.wait_for("JOINT_COMMAND", lambda c: c.tick > last.tick + 30)
        listener.wait_for("JOINT_STATE", lambda s: not any(s.qd))


# --- verify ---


@pytest.mark.parametrize("case", ["c1", "c2", "c3", "c4"])
def test_every_live_tick_is_equal(root: Path, tmp_path: Path, case: str) -> None:
    log = tmp_path / "run.lcm"
    scene = root / "scenarios" / f"{case}.yaml"
    result = leeway("run", scene, "--log", log, "--set=duration_s=1")
    assert result.returncode == 0, result.stderr
    status, found = verify(log)
    assert (status, found["result"]) == (0, "equal")
    (controller,) = found["controllers"]
    assert controller["verified"] == controller["equal"] == ticks_in(log) > 125
    assert controller["mode"] == "realtime"
    assert controller["same_build"]


def test_every_tick_in_lockstep_is_equal(root: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.lcm"
    scene = root / "scenarios" / "c4.yaml"
    result = leeway("run", scene, "--lockstep", "--log", log, "--name", "ARM1")
    assert result.returncode == 0, result.stderr
    status, found = verify(log)
    (controller,) = found["controllers"]
    assert (status, controller["verified"], controller["mode"]) == (0, 1001, "lockstep")


@pytest.mark.parametrize("load", [False, True])
def test_commands_and_a_restart_under_load(root: Path, tmp_path: Path, load: bool) -> None:
    if load and not shutil.which("stress-ng"):
        pytest.skip("stress-ng is not installed: not tried under load")
    log = tmp_path / "run.lcm"
    scene = root / "scenarios" / "reach.yaml"
    stress = (
        subprocess.Popen(["stress-ng", "--quiet", "--cpu", "2", "--matrix", "1"]) if load else None
    )
    try:
        run_with_a_restart(scene, log)
    finally:
        if stress:
            stress.terminate()
            stress.wait(10)
    status, found = verify(log)
    assert found["result"] != "differs", json.dumps(found, indent=2)
    first, second = found["controllers"]
    assert first["verified"] > 100
    assert second["verified"] > 100
    # A recorder that got everything has everything that can be verified.
    if is_whole(log):
        assert (status, first["verified"] + second["verified"]) == (0, ticks_in(log))


@contextlib.contextmanager
def stressed() -> Iterator[None]:
    """Keep every processor busy while the block runs."""
    process = subprocess.Popen(["stress-ng", "--quiet", "--cpu", "2", "--matrix", "1"])
    try:
        yield
    finally:
        process.terminate()
        process.wait(10)


def run_with_a_restart(scene: Path, log: Path) -> None:
    """A live run with all that an operator may do, and a second controller after the first."""
    listener = Listener()
    with recorded(log) as own, running("leeway-simulator", scene):
        with running("leeway-controller", scene):
            listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
            assert bus.send_goal(own, None, (0.3, -0.5, 0.4)) is not None
            assert bus.send_obstacles(own, None, bus.UPSERT, [(9, (0.2, -0.7, 0.6), 0.1)])
            assert bus.send_goal(own, None, None) is not None
            listener.wait_for("JOINT_COMMAND", lambda c: not any(c.qd))
        with running("leeway-controller", scene):
            first = listener.newest["JOINT_COMMAND"].h.session
            began = listener.wait_for(
                "JOINT_COMMAND", lambda c: c.h.session != first and c.mode == c.VELOCITY
            )
            assert bus.send_obstacles(own, None, bus.UPSERT, [(9, (0.2, -0.6, 0.6), 0.1)])
            assert bus.send_obstacles(own, None, bus.CLEAR, [])
            listener.wait_for("JOINT_COMMAND", lambda c: c.tick > began.tick + 100)


def is_whole(log: Path) -> bool:
    """Whether no state and no command is missing, by the messages' own numbers."""
    for channel in ("JOINT_STATE", "JOINT_COMMAND"):
        numbers: dict[int, list[int]] = {}
        for m in read(log, channel):
            numbers.setdefault(m.h.session, []).append(m.h.seq)
        if any(sorted(own) != list(range(1, len(own) + 1)) for own in numbers.values()):
            return False
    return True


def post_mortem(scene: Path, folder: Path) -> Path | None:
    """Log of a plant that died in mid-run; None when a fault of a busy machine came before."""
    listener = Listener()
    with running("leeway-controller", scene, f"--post-mortem={folder}"):
        with running("leeway-simulator", scene) as simulator:
            listener.wait_for("JOINT_COMMAND", lambda c: c.mode == c.VELOCITY)
            own = bus.open_bus(bus.resolve_url(None))
            assert bus.send_obstacles(own, None, bus.UPSERT, [(9, (0.2, -0.9, 0.5), 0.1)])
            listener.wait_for("JOINT_COMMAND", lambda c: c.tick > 400)
            busy = folder.exists()
            simulator.kill()
        wait_until(lambda: any(folder.glob("*.lcm")), 10, "post-mortem log")
    (log,) = folder.glob("*.lcm")
    return None if busy else log


def test_a_post_mortem_log_is_equal_but_for_its_first_tick(root: Path, tmp_path: Path) -> None:
    attempts = (post_mortem(root / "scenarios" / "c4.yaml", tmp_path / f"{k}") for k in range(3))
    log = next(filter(None, attempts))
    status, found = verify(log)
    (c,) = found["controllers"]
    # The log begins in mid-run: of its first tick and of being stuck before nothing is known.
    forgotten = c["unknown"].pop("what it remembered is older than the log", 0)
    assert (status, c["differing"], list(c["unknown"].values())) == (3, 0, [1])
    assert c["verified"] + forgotten == ticks_in(log) - 1 > 200
    assert c["equal"] > 100


# --- damage ---


def write(events: list[Any], path: Path) -> Path:
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for utime, channel, data in events:
        log.write_event(utime, channel, data)
    log.close()
    return path


class Damage:
    """Copies of a log with one message changed."""

    def __init__(self, log: Path, folder: Path) -> None:
        self.events = [(e.timestamp, e.channel, e.data) for e in lcm.EventLog(str(log))]
        self.path = folder / "damaged.lcm"

    def places(self, channel: str) -> list[int]:
        return [k for k, event in enumerate(self.events) if event[1] == channel]

    def place(self, channel: str, session: int, seq: int) -> int:
        """Place of a message."""
        wanted = (session, seq)
        kind = getattr(wire, f"{channel.lower()}_t")
        for k in self.places(channel):
            h = kind.decode(self.events[k][2]).h
            if (h.session, h.seq) == wanted:
                return k
        raise AssertionError(f"no {channel} {wanted}")

    def flip(self, place: int, byte: int, bit: int = 0) -> dict[str, Any]:
        """First controller's result after one bit of one message changed."""
        utime, channel, data = self.events[place]
        changed = bytearray(data)
        changed[byte] ^= 1 << bit
        status, found = self.replace(place, [(utime, channel, bytes(changed))])
        assert (status, found["result"]) == (1, "differs")
        controller: dict[str, Any] = found["controllers"][0]
        return controller

    def replace(self, place: int, events: list[Any]) -> tuple[int, dict[str, Any]]:
        """Verify with one message replaced by others."""
        all_events = [*self.events[:place], *events, *self.events[place + 1 :]]
        return verify(write(all_events, self.path))


def changed(controller: dict[str, Any]) -> list[str]:
    """Names of the inputs that are said to have changed."""
    return [change["name"] for change in controller["first"]["changed"]]


def test_damage_is_found_where_it_was_done(root: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.lcm"
    record_by_hand(root, log)
    assert verify(log)[0] == 0
    damage = Damage(log, tmp_path)
    moving = [c for c in read(log, "JOINT_COMMAND") if c.mode == c.VELOCITY]
    command = moving[len(moving) // 3]
    users = [c.tick for c in read(log, "JOINT_COMMAND") if c.state_seq == command.state_seq]

    # A bit of a joint position, and one of its wall-clock stamp that nothing is controlled by.
    state = damage.place("JOINT_STATE", command.plant_session, command.state_seq)
    for byte, name in ((8 + 32 + 33 + 8 * 2 + 4, "JOINT_STATE q[2]"), (8 + 7, "JOINT_STATE utime")):
        c = damage.flip(state, byte)
        assert (c["first"]["tick"], c["differing"]) == (users[0], len(users))
        assert name in changed(c)

    # A bit of the position of the obstacle that came over the bus.
    heard = [o for o in read(log, "OBSTACLES") if o.n == 1 and o.o[0].id == 77]
    place = damage.place("OBSTACLES", heard[0].h.session, heard[0].h.seq)
    first = next(c.tick for c in moving if c.world_session == heard[0].h.session)
    c = damage.flip(place, 8 + 32 + 25 + 5 + 5)
    assert c["first"]["tick"] == first
    assert "OBSTACLES id 77: p[0]" in changed(c)

    # A bit of the goal.
    (place, *_) = damage.places("GOAL")
    first = next(c.tick for c in moving if c.request_session)
    c = damage.flip(place, 8 + 32 + 8 + 5)
    assert c["first"]["tick"] == first
    assert "GOAL p[1]" in changed(c)

    # A bit of the command itself.
    place = damage.place("JOINT_COMMAND", command.h.session, command.h.seq)
    c = damage.flip(place, 8 + 32 + 4 * 8 + 6 + 8 * 1 + 7)
    assert (c["first"]["tick"], c["differing"]) == (command.tick, 1)
    assert [f["name"] for f in c["first"]["fields"]] == ["qd[1]"]


def test_another_scene_shows_at_the_first_tick(short_log: Path, tmp_path: Path) -> None:
    damage = Damage(short_log, tmp_path)
    damage.events = [
        (t, name, data.replace(b"k_a: 1", b"k_a: 2") if name == "SCENE" else data)
        for t, name, data in damage.events
    ]
    status, found = damage.replace(0, [])
    (c,) = found["controllers"]
    assert (status, c["first"]["tick"], c["first"]["right_inputs"]) == (1, 1, False)
    assert [change["name"] for change in c["first"]["changed"]] == ["SCENE"]


def test_what_is_missing_is_said(short_log: Path, tmp_path: Path) -> None:
    damage = Damage(short_log, tmp_path)
    ticks = ticks_in(short_log)
    used = read(short_log, "JOINT_COMMAND")[100]
    users = [c.tick for c in read(short_log, "JOINT_COMMAND") if c.state_seq == used.state_seq]
    status, found = damage.replace(
        damage.place("JOINT_STATE", used.plant_session, used.state_seq), []
    )
    (c,) = found["controllers"]
    assert (status, found["result"], c["equal"]) == (3, "incomplete", ticks - len(users))
    assert c["first_unknown"] == users[0]

    path = tmp_path / "cut.lcm"
    path.write_bytes(short_log.read_bytes()[: short_log.stat().st_size // 2])
    result = leeway("replay", path, "--verify")
    assert result.returncode == 3
    assert "cut in the middle" in result.stdout
    assert "every bit is equal" in result.stdout


# --- what if ---


def test_what_if(short_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = leeway("replay", short_log, "--set", "law.k_a=2", "-o", out, "--json")
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    (c,) = found["controllers"]
    assert (c["ticks"], c["not_reproduced"], c["open_loop"]) == (ticks_in(short_log), 0, True)
    assert c["differing"] > 200
    assert Path(found["pictures"][0]).read_bytes()[:4] == b"\x89PNG"
    assert leeway("replay", short_log, "--set", "law.rho=1").returncode == 2
    assert leeway("replay", short_log, "--verify", "--set", "law.k_a=1").returncode == 2
