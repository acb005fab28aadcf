"""What if, and playing without a bus."""

from __future__ import annotations

import os
import pty
import termios
from pathlib import Path

import numpy as np
import pytest
from log_maker import event
from replay_maker import CONTROLLER, Recorder, places, usual, write

from leeway.logs.log import LogError, read_tables
from leeway.replay.keys import Keys
from leeway.replay.picture import draw, write_picture
from leeway.replay.play import LATE_S, Player, Recording, Transport, open_recording, press
from leeway.replay.text import what_if_lines
from leeway.replay.whatif import WhatIf, what_if

# --- what if ---


def changed(folder: Path, *sets: str) -> WhatIf:
    return what_if(read_tables(write(usual(), folder / "run.lcm")), CONTROLLER, sets)


def test_nothing_changes_with_the_values_of_the_log(tmp_path: Path) -> None:
    w = changed(tmp_path, "law.rho_rep=1.9")
    assert (len(w.tick), int(w.differs.sum()), w.not_reproduced) == (50, 0, 0)


def test_another_reach_changes_the_ticks_that_know_an_obstacle(tmp_path: Path) -> None:
    w = changed(tmp_path, "law.rho_rep=0.2")
    rows = np.flatnonzero(w.differs)
    assert w.tick[rows[0]] == 5
    one = w.largest[0]
    row = int(np.flatnonzero(w.tick == one.tick)[0])
    assert one.change == w.other_qd[row, 0] - w.qd[row, 0]
    assert abs(one.change) == np.abs(w.other_qd[:, 0] - w.qd[:, 0]).max() > 0
    assert one.t == w.t[row]


def test_flags_gained_and_lost(tmp_path: Path) -> None:
    w = changed(tmp_path, "limits.acceleration=[1,1,1,1,1,1]")
    gained, lost = w.flag_changes()["acceleration"]
    assert gained > 0
    assert lost == 0
    assert f"  flag acceleration: {gained} ticks gain it, 0 lose it" in list(what_if_lines(w))


def test_keys_that_no_tick_uses_are_named(tmp_path: Path) -> None:
    w = changed(tmp_path, "duration_s=3", "plant.rate_hz=250", "law.gamma=2")
    assert w.without_effect == ["duration_s", "plant.rate_hz"]


def test_an_unknown_key_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"law\.rho=1"):
        changed(tmp_path, "law.rho=1")


def test_ticks_without_inputs_are_left_out(tmp_path: Path) -> None:
    log = usual()
    del log[places(log, "JOINT_STATE")[20]]
    w = what_if(read_tables(write(log, tmp_path / "run.lcm")), CONTROLLER, ["law.rho_rep=1.9"])
    assert (w.not_computed, len(w.tick), int(w.differs.sum())) == (1, 49, 0)
    assert 23 not in w.tick


def test_the_picture_shows_both_and_what_changed(tmp_path: Path) -> None:
    w = changed(tmp_path, "law.rho_rep=0.2")
    speeds, changes = draw(w).axes
    t, recorded = speeds.lines[0].get_data()
    assert (t[0], t[-1]) == (0, w.t[-1])
    rows = np.searchsorted(w.tick, 5) + np.arange(len(t))
    np.testing.assert_array_equal(recorded, w.qd[rows, 0])
    np.testing.assert_array_equal(changes.lines[0].get_ydata(), (w.other_qd - w.qd)[rows, 0])
    assert write_picture(w, tmp_path / "out").read_bytes()[:4] == b"\x89PNG"


def test_the_picture_shows_the_newest_plant_alone(tmp_path: Path) -> None:
    r = Recorder()
    r.obstacles(7, 1, [])
    r.tick(20)
    r.state, r.command = None, None
    r.tick(10)
    w = what_if(read_tables(write(r.log, tmp_path / "run.lcm")), CONTROLLER, ["law.k_a=2"])
    t = draw(w).axes[0].lines[0].get_xdata()
    assert len(np.atleast_1d(t)) == 10


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
