"""What another scene would have commanded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from replay_maker import CONTROLLER, Recorder, places, usual, write

from leeway.logs.log import read_tables
from leeway.replay.picture import draw, write_picture
from leeway.replay.text import what_if_lines
from leeway.replay.whatif import WhatIf, what_if


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
    del log[places(log, "JOINT_STATE")[8]]  # while the arm speeds up
    w = what_if(read_tables(write(log, tmp_path / "run.lcm")), CONTROLLER, ["law.rho_rep=1.9"])
    assert (w.not_computed, len(w.tick), int(w.differs.sum())) == (1, 49, 0)
    assert 11 not in w.tick


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
