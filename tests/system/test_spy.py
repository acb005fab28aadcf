"""lcm-spy with Leeway's dialog, as a person uses it: right click, values, buttons."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers import leeway, wait_until
from leeway_lcm import leeway as wire
from relay import HEADER
from rig import PLANT_PORT, recording, url_of
from spy_driver import DIALOG_ITEM, DIALOG_TITLE, Spy, driving

from leeway.bus import decode, header, new_session, open_bus

pytestmark = [pytest.mark.gui, pytest.mark.usefixtures("private_network")]

OTHER_PORT = 7669
PERIOD_S = 0.05
KINDS = {"OBSTACLES": wire.obstacles_t, "HULL": wire.hull_t}
ROWS = {
    "JOINT_STATE": wire.joint_state_t,
    "OBSTACLES": wire.obstacles_t,
    "STATUS": wire.status_t,
    "WORLD": wire.obstacles_t,
}


class Traffic:
    """Senders that give spy its rows, and a controller that tells what it takes in."""

    def __init__(self, port: int) -> None:
        self.session = new_session()
        self.controller = "takes"  # or "ignores", or "none"
        self.offset_ns = 0  # of its clock
        self._seq = 0
        self._newest: Any = None
        self._bus = open_bus(url_of(port))
        for channel in KINDS:
            self._bus.subscribe(channel, self._on_change)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _on_change(self, channel: str, data: bytes) -> None:
        message = decode(KINDS[channel], data)
        if message is None or message.h.session == self.session:
            return
        if self.controller == "takes":
            self._newest = (channel, message.h)

    def _run(self) -> None:
        while not self._ended.is_set():
            self._seq += 1
            for channel, kind in ROWS.items():
                message = kind()
                message.h = header(self.session, self._seq)
                self._bus.publish(channel, message.encode())
            if self.controller != "none":
                self._bus.publish("JOINT_COMMAND", self._command().encode())
            self._bus.handle(PERIOD_S)

    def _command(self) -> Any:
        command = wire.joint_command_t()
        command.h = header(self.session, self._seq)
        command.tick_ns = command.h.mono_ns + self.offset_ns
        command.obstacle_count = 12
        if self._newest is not None:
            channel, h = self._newest
            command.world_channel = getattr(command, channel)
            command.world_session, command.world_seq = h.session, h.seq
        return command

    def end(self) -> None:
        """Stop sending."""
        self._ended.set()
        self._thread.join()
        self._bus.close()


@contextlib.contextmanager
def traffic(port: int = PLANT_PORT) -> Iterator[Traffic]:
    """Give spy its rows while the block runs."""
    senders = Traffic(port)
    try:
        yield senders
    finally:
        senders.end()


class Sent:
    """What the dialog has sent, each message once."""

    def __init__(self, spy: Spy, senders: Traffic) -> None:
        self._spy, self._senders = spy, senders

    def all(self) -> list[tuple[str, Any]]:
        """Return channel and message in order."""
        found: dict[tuple[str, int, int], bytes] = {}
        for channel, data in self._spy.record.packets():
            session, seq = HEADER.unpack_from(data)
            if channel in KINDS and session != self._senders.session:
                found.setdefault((channel, session, seq), data)
        return [(channel, KINDS[channel].decode(data)) for (channel, *_), data in found.items()]

    def next(self, count: int) -> tuple[str, Any]:
        """Wait for the message with a number from 1 on; it must be the last."""
        wait_until(lambda: len(self.all()) >= count, 5, f"message {count}")
        assert len(self.all()) == count
        return self.all()[-1]

    def repeats(self) -> int:
        """Return how often the last message was sent, each time with the same bytes."""
        channel, message = self.all()[-1]
        return self._spy.record.packets().count((channel, message.encode()))


def rounded(values: Any) -> list[float]:
    return [round(v, 12) for v in values]


def test_spy_finds_every_type_one_plugin_and_offers_it_where_it_should(
    root: Path, tmp_path: Path
) -> None:
    with traffic(), driving(tmp_path) as spy:
        types = len(list((root / "lcmtypes").glob("*.lcm")))
        assert spy.said.find(f"^Found {types} LCM types$")
        plugins = [line for line in spy.said.lines if "Leeway obstacles" in line]
        assert len([line for line in plugins if line.endswith("active")]) == 1
        assert len([line for line in plugins if not line.endswith("idle")]) == 1
        for channel in ("JOINT_STATE", "OBSTACLES", "WORLD"):
            spy.open_dialog(channel)
        # The menu goes round: behind its last item comes the first, the viewer, titled as the row.
        spy.choose("STATUS", DIALOG_ITEM, "STATUS")
        spy.choose("WORLD", DIALOG_ITEM + 1, "WORLD")
        assert len(spy.windows(DIALOG_TITLE)) == 3


def test_obstacles_are_added_moved_removed_and_cleared(tmp_path: Path) -> None:
    with (
        traffic(OTHER_PORT) as senders,
        recording(PLANT_PORT) as default_bus,
        driving(tmp_path, port=OTHER_PORT) as spy,
    ):
        sent = Sent(spy, senders)
        spy.open_dialog("WORLD")
        spy.fill(shape="sphere", id=7, position=(0.77, -0.5, 0.4), size=0.1)
        spy.press("add")
        spy.wait_said("sphere 7 at 0.77 -0.5 0.4: the controller has it, obstacles now: 12$")
        channel, m = sent.next(1)
        assert (channel, m.op, m.n, m.h.seq, m.valid_for_ms) == ("OBSTACLES", m.UPSERT, 1, 1, 0)
        assert m.time_ns == m.h.mono_ns
        o, session = m.o[0], m.h.session
        assert (o.id, o.shape, o.p, o.radius) == (7, o.SPHERE, (0.77, -0.5, 0.4), 0.1)
        assert (o.quat, o.v, o.omega) == ((1, 0, 0, 0), (0, 0, 0), (0, 0, 0))

        # Wrong texts are told and nothing is sent.
        for row, text, name in (
            ("id", "0", "id"),
            ("id", "7", None),
            ("position", ("abc", "0", "0"), "x"),
            ("position", ("0", "NaN", "0"), "y"),
            ("position", ("0", "0", ""), "z"),
            ("position", ("0", "0", "0.3"), None),
            ("size", "0", "radius"),
            ("size", "-1", "radius"),
            ("size", "inf", "radius"),
            ("size", "0.2", None),
        ):
            spy.fill(**{row: text})
            if name is not None:
                spy.press("add")
                spy.wait_said(f"^leeway: error: {name}: expected ")

        # The same id moves.
        spy.press("enter")
        spy.wait_said("the controller has it")
        _, m = sent.next(2)
        assert (m.h.session, m.h.seq, m.n) == (session, 2, 1)
        assert (m.o[0].id, m.o[0].p, m.o[0].radius) == (7, (0, 0, 0.3), 0.2)

        spy.press("remove")
        spy.wait_said("removal of 7: the controller has it")
        _, m = sent.next(3)
        assert (m.op, m.n, m.o[0].id, m.h.seq) == (m.REMOVE, 1, 7, 3)
        spy.press("clear")
        spy.wait_said("removal of all: the controller has it")
        _, m = sent.next(4)
        assert (m.op, m.n, m.h.seq) == (m.CLEAR, 0, 4)
        assert not [p for p in default_bus.packets() if p[0] in KINDS], "sent on another bus"


def test_every_shape_has_its_fields_and_the_last_values_are_remembered(tmp_path: Path) -> None:
    with traffic() as senders:
        with driving(tmp_path) as spy:
            sent = Sent(spy, senders)
            spy.open_dialog("OBSTACLES")
            spy.fill(shape="capsule", id=2, orientation=(0, 90, 0), size=(0.05, 0.3))
            spy.press("add")
            o = sent.next(1)[1].o[0]
            assert (o.shape, o.radius, o.size) == (o.CAPSULE, 0.05, (0.3, 0, 0))
            assert rounded(o.quat) == rounded([0.5**0.5, 0, 0.5**0.5, 0])
            spy.fill(shape="plane", id=3, orientation=(0, 0, 0))
            spy.press("add")
            o = sent.next(2)[1].o[0]
            assert (o.shape, o.radius, o.size) == (o.HALFSPACE, 0, (0, 0, 0))
            spy.fill(shape="hull", id=4, size=("0 0 0, 0.1 0 0", 0.02))
            spy.press("add")
            spy.wait_said("hull 4 at 1.0 1.0 0.4: the controller has it")
            channel, m = sent.next(3)
            assert (channel, m.n, m.h.seq, m.o.id, m.o.radius) == ("HULL", 2, 1, 4, 0.02)
            spy.fill(
                shape="box", id=5, size=(0.1, 0.2, 0.3, 0), velocity=(0.1, 0, -0.2), lifetime=2
            )
            spy.press("add")
            _, m = sent.next(4)
            assert (m.h.seq, m.valid_for_ms, m.o[0].v) == (3, 2000, (0.1, 0, -0.2))
            assert (m.o[0].shape, m.o[0].size) == (m.o[0].BOX, (0.1, 0.2, 0.3))
            first = m
        with driving(tmp_path) as spy:
            spy.open_dialog("JOINT_STATE")
            spy.press("add")
            _, m = Sent(spy, senders).next(1)
            assert m.o[0].encode() == first.o[0].encode()
            assert m.valid_for_ms == first.valid_for_ms
            assert m.h.session != first.h.session


def test_the_dialog_tells_what_became_of_a_change(tmp_path: Path) -> None:
    with traffic() as senders, driving(tmp_path) as spy:
        sent = Sent(spy, senders)
        senders.controller = "none"
        spy.open_dialog("WORLD")
        spy.press("add")
        spy.wait_said("sent 5 times; no controller on this bus")
        assert sent.repeats() == 5
        # In lockstep the controller's clock starts at 0.
        senders.controller, senders.offset_ns = "takes", -(10**14)
        spy.press("add")
        assert spy.wait_said("the controller has it").endswith("obstacles now: 12")
        assert sent.repeats() < 5
        spy.fill(velocity=("0.1",))
        spy.press("add")
        spy.wait_said("has it, obstacles now: 12; its clock is another: no velocity, no lifetime")
        # Number 3 of OBSTACLES, which the controller goes on telling, is not number 1 of HULL.
        senders.controller = "ignores"
        spy.fill(shape="hull")
        spy.press("add")
        spy.wait_said("sent 5 times; the controller has not taken it: `leeway status`")
        # Nor is it the number 4 that comes now.
        spy.fill(shape="sphere")
        spy.press("add")
        spy.wait_said("sphere 1 at .* sent 5 times; the controller has not taken it")


def test_one_robot_is_listened_to_by_its_name(tmp_path: Path) -> None:
    with traffic(), driving(tmp_path, "--name", "ARM1") as spy:
        assert "ARM1" in spy.xdotool("getwindowname", spy.main)
        spy.open_dialog("WORLD")
        spy.press("add")
        spy.wait_said("no controller on this bus")


def test_json_is_refused() -> None:
    result = leeway("spy", "--json")
    assert (result.returncode, result.stdout) == (2, "")
