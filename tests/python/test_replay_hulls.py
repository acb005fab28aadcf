"""Verifying logs with hulls: what must be equal is, and damage is found where it was done."""

from __future__ import annotations

from pathlib import Path

import pytest
from replay_maker import Recorder, places
from test_replay_verify import FIRST_P, flip, only, verified, without

# Where in HULL the values are: behind fingerprint, header, owner, time and expiry the obstacle.
OF_HULL = {
    "OBSTACLES id 5: time_ns": 8 + 32 + 8 + 7,
    "OBSTACLES id 5: p[2]": FIRST_P - 5 + 16,
    "OBSTACLES id 5: quat[0]": FIRST_P - 5 + 24 + 7,
    "OBSTACLES id 5: v[0]": FIRST_P - 5 + 24 + 32 + 8 + 24 + 7,
    "OBSTACLES id 5: omega[2]": FIRST_P - 5 + 24 + 32 + 8 + 24 + 24 + 16 + 7,
    "HULL id 5: vertex[4]": 8 + 32 + 8 + 8 + 4 + 141 + 4 + 4 * 8 + 7,
    "HULL id 5: vertex[23]": 8 + 32 + 8 + 8 + 4 + 141 + 4 + 23 * 8 + 7,
}


@pytest.mark.parametrize("name", OF_HULL)
def test_a_bit_of_a_hull(tmp_path: Path, name: str) -> None:
    r = Recorder()
    r.tick(3)
    r.obstacles(7, 1, [(1, (0.6, -0.5, 0.5), 0.1)])
    r.hull(8, 1, 5)
    r.hull(9, 1, 6, 20)
    r.tick(4)
    whole = only(result := verified(r.log, tmp_path))
    assert (whole.equal, result.result) == (7, "equal")
    c = only(result := verified(flip(r.log, places(r.log, "HULL")[0], OF_HULL[name]), tmp_path))
    assert c.first is not None
    assert (c.first.tick, c.differing, result.result) == (4, 4, "differs")
    # A time also moves the expiry.
    assert name in [change.name for change in c.first.changed] or "time" in name


def test_a_hull_that_is_missing(tmp_path: Path) -> None:
    r = Recorder()
    r.hull(8, 1, 5)
    r.tick(3)
    r.hull(8, 2, 6)
    r.tick(3)
    r.hull(8, 3, 7)
    r.tick(3)
    c = only(result := verified(without(r.log, places(r.log, "HULL")[1]), tmp_path))
    assert result.result == "incomplete"
    assert list(c.unknown) == ["OBSTACLES or HULL it had taken are not in the log"]
    assert c.differing == 0
