"""Playing a log: time, keys and messages, without a bus."""

from __future__ import annotations

import os
import pty
import termios
from pathlib import Path

import numpy as np
import pytest
from log_maker import event

from leeway.logs.log import LogError
from leeway.replay.keys import Keys
from leeway.replay.play import LATE_S, Player, Recording, Transport, open_recording, press

# --- where playing is ---


def test_time_passes_at_the_chosen_pace() -> None:
    transport = Transport(100.0, 0.0, 2.0, now=10.0)
    assert transport.position(13.0) == 6.0
    assert transport.due(8.0, 13.0) == 1.0
    transport.change_speed(1, 13.0)
    assert transport.speed == 5.0
    assert transport.position(14.0) == 11.0


def test_speeds_end_somewhere() -> None:
    transport = Transport(100.0, 0.0, 3.0, now=0.0)
    transport.change_speed(-1, 0.0)
    assert transport.speed == 2.0
    transport.change_speed(99, 0.0)
    assert transport.speed == 100.0
    transport.change_speed(-99, 0.0)
    assert transport.speed == 0.1


def test_a_pause_is_no_time() -> None:
    transport = Transport(100.0, 0.0, 1.0, now=0.0)
    transport.toggle_pause(3.0)
    assert transport.position(50.0) == 3.0
    transport.toggle_pause(50.0)
    assert transport.position(51.0) == 4.0


def test_seeking_stays_in_the_log() -> None:
    transport = Transport(20.0, 0.0, 1.0, now=0.0)
    assert transport.seek(-5, 2.0) == 0.0
    assert transport.seek(50, 2.0) == 20.0
    transport.toggle_pause(2.0)
    assert transport.seek(-5, 9.0) == 15.0
    assert transport.position(99.0) == 15.0


class Bench:
    """A player whose messages are collected, with a clock of its own."""

    def __init__(self, folder: Path, times: list[float], channels: str | None = None) -> None:
        path = folder / "run.lcm"
        events = [
            event("A" if k % 2 else "B", bytes([k]), round(t * 1e6)) for k, t in enumerate(times)
        ]
        path.write_bytes(b"".join(events))
        self.out: list[tuple[float, int]] = []
        self.now = 100.0
        recording = open_recording(path, channels)
        self.transport = Transport(recording.duration, 0.0, 1.0, self.now)
        self.player = Player(recording, self.transport, self._publish)

    def _publish(self, _: str, data: bytes) -> None:
        self.out.append((round(self.now - 100.0, 6), data[0]))

    def run(self, seconds: float, step: float = 0.01) -> None:
        """Let time pass."""
        for _ in range(round(seconds / step)):
            while self.player.send_due(self.now) <= 0:
                pass
            self.now += step


def test_messages_are_sent_when_they_are_due(tmp_path: Path) -> None:
    bench = Bench(tmp_path, [50.0, 50.5, 50.52, 52.0])
    bench.run(3)
    times, numbers = zip(*bench.out, strict=True)
    assert numbers == (0, 1, 2, 3)
    assert times == pytest.approx((0.0, 0.5, 0.52, 2.0), abs=0.0101)
    assert bench.player.ended
    assert dict(bench.player.sent) == {"A": 2, "B": 2}


def test_a_pause_is_followed_by_no_burst(tmp_path: Path) -> None:
    bench = Bench(tmp_path, [k * 0.1 for k in range(40)])
    bench.run(1)
    press(bench.player, " ", bench.now)
    count = len(bench.out)
    bench.run(10)
    assert len(bench.out) == count
    press(bench.player, " ", bench.now)
    bench.run(1)
    times = [t for t, _ in bench.out[count:]]
    assert np.diff(times) == pytest.approx(0.1, abs=0.0101)


def test_a_process_that_stood_still_does_not_hurry(tmp_path: Path) -> None:
    bench = Bench(tmp_path, [k * 0.1 for k in range(40)])
    bench.run(1)
    count = len(bench.out)
    bench.now += 2.0
    bench.run(1)
    assert len(bench.out) - count == pytest.approx(10 + LATE_S / 0.1, abs=3)
    assert np.diff([t for t, _ in bench.out[count:]]).min() > 0.05


def test_arrows_jump(tmp_path: Path) -> None:
    bench = Bench(tmp_path, [float(k) for k in range(20)])
    bench.run(2.05)
    press(bench.player, "right", bench.now)
    bench.run(1)
    press(bench.player, "left", bench.now)
    bench.run(1)
    assert [number for _, number in bench.out] == [0, 1, 2, 8, 4]
    assert press(bench.player, "x", bench.now)
    assert not press(bench.player, "q", bench.now)


def test_channels_are_chosen_by_their_whole_name(tmp_path: Path) -> None:
    assert set(Bench(tmp_path, [0, 1, 2], "A").player.recording.channels) == {"A"}
    assert len(Bench(tmp_path, [0, 1, 2], "A|B").player.recording) == 3


def test_lcm_self_tests_stay_out(tmp_path: Path) -> None:
    path = tmp_path / "run.lcm"
    names = ["LCM_SELF_TEST", "A", "LCM_SELF_TEST_2"]
    path.write_bytes(b"".join(event(name, b"x", k) for k, name in enumerate(names)))
    assert open_recording(path).channels == ["A", "LCM_SELF_TEST_2"]
    assert open_recording(path, ".*").channels == names


def test_a_clock_set_back_does_not_stop_time(tmp_path: Path) -> None:
    recording = Bench(tmp_path, [5.0, 6.0, 3.0, 7.0]).player.recording
    assert recording.t.tolist() == [0.0, 1.0, 1.0, 2.0]


def test_a_cut_log_is_played_to_its_last_whole_event(tmp_path: Path) -> None:
    path = tmp_path / "run.lcm"
    path.write_bytes(event("A", b"1", 0) + event("A", b"2", 1)[:-1])
    recording: Recording = open_recording(path)
    assert (len(recording), recording.truncated_bytes) == (1, 29)


def test_no_log_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.lcm"
    path.write_bytes(b"no log at all, but long enough for a header")
    with pytest.raises(LogError, match="not an LCM log"):
        open_recording(path)


# --- keys ---


@pytest.mark.parametrize(
    ("typed", "key"),
    [
        (b" ", " "),
        (b"q", "q"),
        (b"\x1b[C", "right"),
        (b"\x1b[D", "left"),
        (b"\x1bOD", "left"),
        (b"\x1b[A", None),
        (b"\x1b", None),
    ],
)
def test_keys_of_a_terminal(typed: bytes, key: str | None) -> None:
    ours, theirs = pty.openpty()
    try:
        attributes = termios.tcgetattr(theirs)
        attributes[3] &= ~(termios.ICANON | termios.ECHO)
        termios.tcsetattr(theirs, termios.TCSANOW, attributes)
        os.write(ours, typed)
        assert Keys(theirs).wait(5.0) == key
    finally:
        os.close(ours)
        os.close(theirs)
