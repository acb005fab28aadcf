"""Logs of real processes, replayed: verified bit by bit, damaged, played on the bus."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import shutil
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lcm
import pytest
from helpers import Listener, leeway, read, running, start_leeway, wait_until
from leeway_lcm import leeway as wire

from leeway import bus
from leeway.processes import Child, program

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
def recorded(log: Path) -> Iterator[lcm.LCM]:
    """Record all that happens in the block, to the last message; a bus to speak on."""
    own = lcm.LCM(bus.resolve_url(None))
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


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of what the tests of this module share."""
    return tmp_path_factory.mktemp("replay")


@pytest.fixture
def short_log(root: Path, shelf: Path) -> Path:
    """Two seconds of a run, recorded by the first test that needs them."""
    log = shelf / "run.lcm"
    if not log.exists():
        result = leeway("run", root / "scenarios" / "c1.yaml", "--log", log, "--set=duration_s=2")
        assert result.returncode == 0, result.stderr
    return log


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
    c = damage.flip(place, 8 + 32 + 5 + 4 + 5)
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


def test_another_scene_shows_at_the_first_tick_it_matters_to(
    short_log: Path, tmp_path: Path
) -> None:
    damage = Damage(short_log, tmp_path)
    damage.events = [
        (t, name, data.replace(b"k_a: 1", b"k_a: 2") if name == "SCENE" else data)
        for t, name, data in damage.events
    ]
    status, found = damage.replace(0, [])
    (c,) = found["controllers"]
    assert (status, c["first"]["tick"], c["first"]["right_inputs"]) == (1, 1, True)


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


# --- play ---


class Ears:
    """Everything on the bus, in order, with the time at which it came."""

    def __init__(self) -> None:
        self.bus = lcm.LCM(bus.resolve_url(None))
        self.heard: list[tuple[str, bytes]] = []
        self.times: list[float] = []
        self.bus.subscribe(".*", self._on_message).set_queue_capacity(0)

    def _on_message(self, channel: str, data: bytes) -> None:
        if channel != "LCM_SELF_TEST":
            self.heard.append((channel, data))
            self.times.append(time.monotonic())

    def listen(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.bus.handle_timeout(max(1, round(left * 1e3)))

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Listen until a condition is met."""
        end = time.monotonic() + 10
        while not condition():
            assert time.monotonic() < end, f"no {what}"
            self.listen(0.02)

    def follow(self, process: subprocess.Popen[Any], patience: float = 30) -> None:
        """Listen until a process has ended and nothing comes any more."""
        end = time.monotonic() + patience
        while process.poll() is None:
            assert time.monotonic() < end, "the player does not end"
            self.bus.handle_timeout(20)
        while self.bus.handle_timeout(100):
            pass


def messages(log: Path, *channels: str) -> list[tuple[str, bytes]]:
    """Messages of a log in its order."""
    return [
        (e.channel, e.data)
        for e in lcm.EventLog(str(log))
        if e.channel != "LCM_SELF_TEST" and (not channels or e.channel in channels)
    ]


def seconds_of(log: Path) -> float:
    stamps = [e.timestamp for e in lcm.EventLog(str(log)) if e.channel != "LCM_SELF_TEST"]
    return (max(stamps) - min(stamps)) * 1e-6


def test_play_sends_every_byte_in_order_and_in_time(short_log: Path) -> None:
    ears = Ears()
    player = start_leeway("replay", short_log, "--play", "--json")
    ears.follow(player)
    assert player.returncode == 0
    assert ears.heard == messages(short_log)
    assert ears.times[-1] - ears.times[0] == pytest.approx(seconds_of(short_log), abs=0.5)
    assert player.stdout is not None
    assert sum(json.loads(player.stdout.read())["sent"].values()) == len(ears.heard)


def test_play_faster_from_the_middle_on_some_channels(short_log: Path) -> None:
    ears = Ears()
    options = ["--speed", "5", "--seek", "1.5", "--channels", "JOINT_STATE|GOAL"]
    player = start_leeway("replay", short_log, "--play", *options)
    ears.follow(player)
    assert player.returncode == 0
    expected = messages(short_log, "JOINT_STATE")
    assert 50 < len(ears.heard) < len(expected)
    assert ears.heard == expected[-len(ears.heard) :]
    assert ears.times[-1] - ears.times[0] < 1.0


def test_lcm_logplayer_plays_our_logs(short_log: Path) -> None:
    ears = Ears()
    player = subprocess.Popen(
        [str(program("lcm-logplayer")), f"--lcm-url={bus.resolve_url(None)}", str(short_log)],
        stdout=subprocess.DEVNULL,
    )
    ears.follow(player)
    assert player.returncode == 0
    assert ears.heard == messages(short_log)


def test_play_stays_away_from_a_running_arm(root: Path, short_log: Path) -> None:
    with running("leeway-simulator", root / "scenarios" / "c1.yaml"):
        Listener().wait_for("JOINT_STATE", lambda s: True)
        refused = leeway("replay", short_log, "--play")
        assert refused.returncode == 1
        assert "JOINT_STATE is published on this bus already" in refused.stderr
        for remedy in ("--lcm-url", "--channels", "--force"):
            assert remedy in refused.stderr
        fast = ["--speed", "100"]
        assert (
            leeway("replay", short_log, "--play", "--channels", "OBSTACLES", *fast).returncode == 0
        )
        assert leeway("replay", short_log, "--play", "--force", *fast).returncode == 0


class Terminal:
    """`leeway replay --play` on a terminal of its own."""

    def __init__(self, *args: object) -> None:
        self.ours, theirs = pty.openpty()
        self.before = termios.tcgetattr(theirs)
        self.theirs = theirs
        command = [sys.executable, "-m", "leeway", "replay", *map(str, args)]
        self.process = subprocess.Popen(
            ["setsid", "--ctty", *command],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
        )
        self.shown = ""

    def press(self, keys: bytes) -> None:
        os.write(self.ours, keys)

    def read(self) -> str:
        """All that was shown so far."""
        os.set_blocking(self.ours, False)
        with contextlib.suppress(BlockingIOError, OSError):
            while data := os.read(self.ours, 4096):
                self.shown += data.decode(errors="replace")
        return self.shown

    def end(self) -> int:
        """Wait for the end; close the terminal, which must be as before."""
        try:
            status = self.process.wait(10)
            assert termios.tcgetattr(self.theirs) == self.before
            self.read()
            return status
        finally:
            self.process.kill()
            self.process.wait()
            os.close(self.ours)
            os.close(self.theirs)


def test_keys_on_a_terminal(short_log: Path) -> None:
    ears = Ears()
    terminal = Terminal(short_log, "--play", "--speed", "0.2")
    ears.wait(lambda: bool(ears.heard), "first message")
    assert termios.tcgetattr(terminal.theirs) != terminal.before
    terminal.press(b" ")
    wait_until(lambda: "paused" in terminal.read(), 5, "pause on the screen")
    ears.listen(0.2)
    count = len(ears.heard)
    ears.listen(1.0)
    assert len(ears.heard) == count
    terminal.press(b" ")
    ears.listen(1.0)
    went_on = len(ears.heard) - count
    rate = len(messages(short_log)) / seconds_of(short_log) * 0.2
    assert 0 < went_on < 3 * rate
    terminal.press(b"\x1b[D")  # back to the beginning
    count = len(ears.heard)
    first = messages(short_log)[0]
    ears.wait(lambda: first in ears.heard[count:], "first message once more")
    terminal.press(b"+")
    wait_until(lambda: "x 0.5" in terminal.read(), 5, "speed on the screen")
    terminal.press(b"q")
    assert terminal.end() == 0
    assert "sent in" in terminal.shown


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_ends_playing_and_the_terminal_is_as_before(
    short_log: Path, number: signal.Signals, status: int
) -> None:
    ears = Ears()
    terminal = Terminal(short_log, "--play", "--speed", "0.1")
    ears.wait(lambda: bool(ears.heard), "first message")
    if number == signal.SIGINT:
        terminal.press(b"\x03")
    else:
        os.kill(terminal.process.pid, number)  # setsid has become the player
    assert terminal.end() == status
