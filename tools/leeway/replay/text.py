"""What people read about a replay: results in words, and the line that shows where playing is."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator

from leeway import _native
from leeway.replay.play import Player
from leeway.replay.verify import ControllerResult, Difference, FieldDifference, Verification
from leeway.replay.whatif import WhatIf

FIELDS_MAX = 12  # differing fields listed
KEYS = "space pause, left/right 5 s, +/- speed, q quit"


def verification_lines(v: Verification) -> Iterator[str]:
    """Yield what came of a log."""
    yield f"{v.path}: {v.result}"
    if v.truncated_bytes:
        yield f"  cut in the middle: {v.truncated_bytes} bytes after the last whole event left out"
    for c in v.controllers:
        yield from _controller_lines(c)


def _controller_lines(c: ControllerResult) -> Iterator[str]:
    yield f"controller {c.session} ({c.file}, {c.mode})"
    again = f" ({c.sent_again} commands sent again)" if c.sent_again else ""
    if c.differing:
        yield f"  {c.verified} ticks verified: {c.differing} differ{again}"
    else:
        yield f"  {c.verified} ticks verified: every bit is equal{again}"
    if not c.same_build:
        yield f"  recorded by {c.build!r}, computed again by {_native.BUILD!r}"
    if not c.own_scene:
        yield "  its own SCENE is not in the log: configuration taken from another program's"
    if c.damaged_scenes:
        yield f"  {c.damaged_scenes} of its SCENE messages say something else than the others"
    for reason, ticks in c.unknown.items():
        yield f"  {ticks} ticks not verifiable: {reason} (first is tick {c.first_unknown})"
    if c.not_in_log:
        yield f"  {c.not_in_log} ticks whose commands are not in the log"
    if c.first is not None:
        fields = ", ".join(f"{name} in {ticks}" for name, ticks in c.fields.most_common())
        yield f"  fields that differ, ticks: {fields}"
        yield from _difference_lines(c.first)


def _difference_lines(d: Difference) -> Iterator[str]:
    yield f"  first difference: tick {d.tick}, t = {d.t:.3f} s, command seq {d.seq}"
    for field in d.fields[:FIELDS_MAX]:
        yield f"    {field.name:20} {_values(field)}"
    if len(d.fields) > FIELDS_MAX:
        yield f"    and {len(d.fields) - FIELDS_MAX} fields more"
    if d.right_inputs:
        yield "    its inputs are those that the controller had, so the command in the log was"
        yield "    changed, or other code or another configuration computed it"
        return
    yield "    an input in the log is not what the controller had:"
    for change in d.changed:
        yield f"      {change.name}: the controller had {change.had}, the log has {change.log}"
    if not d.changed:
        likely = (
            " or ".join(d.suspects)
            or "the scene, or a value of JOINT_STATE, OBSTACLES or HULL without an echo"
        )
        yield f"      no single value explains it; by the fields that differ: {likely}"


def _values(field: FieldDifference) -> str:
    recorded, replayed = f"{field.recorded!r}", f"{field.replayed!r}"
    text = f"recorded {recorded}, computed {replayed}"
    if recorded == replayed:
        text += f" (bits {field.recorded_bits}, {field.replayed_bits})"
    return text


def what_if_lines(w: WhatIf) -> Iterator[str]:
    """Yield how the commands of one controller would have been others."""
    yield f"controller {w.session} ({w.file}), open loop with {', '.join(w.sets)}"
    yield "  every tick gets its recorded inputs; the arm does not follow the other commands"
    for key in w.without_effect:
        yield f"  {key} has no effect on the commands: no tick uses it"
    if w.not_computed:
        yield f"  {w.not_computed} ticks left out: their inputs are not in the log"
    if w.not_reproduced:
        yield f"  {w.not_reproduced} ticks differ without any change: see leeway replay --verify"
    rows = w.differs.nonzero()[0]
    if not len(rows):
        yield f"  {len(w.tick)} ticks, none differs"
        return
    first = int(rows[0])
    begin = f"first tick {w.tick[first]}, t = {w.t[first]:.3f} s"
    yield f"  {len(rows)} of {len(w.tick)} ticks differ, {begin}"
    yield "  joint  largest change [rad/s]  at t [s]     tick"
    for one in w.largest:
        yield f"  {one.joint:5}  {one.change:+22.6g}  {one.t:8.3f}  {one.tick:7}"
    for name, (gained, lost) in w.flag_changes().items():
        yield f"  flag {name}: {gained} ticks gain it, {lost} lose it"


def show_position(player: Player, now: float) -> None:
    """Rewrite the progress line."""
    transport = player.transport
    position = min(transport.position(now), transport.duration)
    state = "paused" if transport.paused else f"x {transport.speed:g}"
    sent = sum(player.sent.values())
    line = f"{position:7.1f} of {transport.duration:.1f} s  {state:7}  {sent} sent   {KEYS}"
    width = shutil.get_terminal_size().columns - 1  # a longer line would stay and begin anew
    print(f"\r\033[K{line[:width]}", end="", file=sys.stderr, flush=True)
