"""Status messages in words, and who is heard."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import lcm
import pytest
from leeway_lcm import leeway as wire
from rich.console import Console
from typer.testing import CliRunner

from leeway import status, watch
from leeway.bus import header, resolve_url
from leeway.cli import app


def message(session: int = 7, mono_ns: int = 0, ticks: int = 0, **fields: Any) -> Any:
    """Return a status_t as a program sends it."""
    made = wire.status_t()
    made.h = header(session, 1)
    made.h.mono_ns = mono_ns
    made.state, made.period_ns, made.ticks = made.RUNNING, 2_000_000, ticks
    made.clearance = math.inf
    for name, value in fields.items():
        setattr(made, name, value)
    return made


# --- names ---


def test_every_constant_of_the_wire_has_a_place() -> None:
    constants = {k for k, v in vars(wire.status_t).items() if isinstance(v, int) and k[0] != "_"}
    named = [*status.STATES, *status.FAULTS, *status.REALTIME, *status.REASONS]
    assert sorted(named) == sorted(constants - {"NREASONS", "NPERCENTILES"})


@pytest.mark.parametrize("name", status.STATES)
def test_states(name: str) -> None:
    assert status.state_name(getattr(wire.status_t, name)) == name.lower()


def test_a_state_of_another_version_keeps_its_number() -> None:
    assert status.state_name(99) == "state 99"


def test_bits_become_names_in_their_order() -> None:
    t = wire.status_t
    assert status.fault_names(0) == []
    assert status.fault_names(t.LEASE | t.OVERRUN) == ["overrun", "lease"]
    assert status.fault_names(t.PEER_TIMEOUT | 1 << 20) == ["peer_timeout", "bit 1048576"]
    assert status.realtime_names(t.PINNED | t.FIFO) == ["fifo", "pinned"]
    assert status.fault_names(-(1 << 31)) == ["bit 2147483648"]


def test_reasons_that_never_came_are_left_out() -> None:
    counts = [0] * wire.status_t.NREASONS
    counts[wire.status_t.FULL], counts[wire.status_t.SIZE], counts[15] = 3, 1, 2
    assert status.refusals(counts) == {"size": 1, "full": 3, "reason 15": 2}


def test_a_message_in_words() -> None:
    t = wire.status_t
    sent = message(
        faults=t.UNSENT,
        faults_ever=t.UNSENT | t.BAD_INPUT,
        realtime=t.LOCKED,
        wake_late_ns=[1500, 2500, 3500, 921930],
        allocations=0,
        minor_faults=5,
        clearance=-0.02,
    )
    found = status.status_of(wire.status_t.decode(sent.encode()))
    assert (found.state, found.faults, found.realtime) == ("running", ["unsent"], ["locked"])
    assert found.faults_ever == ["bad_input", "unsent"]
    assert found.wake_late_us == status.Percentiles(1.5, 2.5, 3.5, 921.93)
    assert (found.rate_hz, found.minor_faults, found.allocations) == (500.0, 5, 0)
    assert found.clearance == -0.02  # inside of an obstacle


@pytest.mark.parametrize("distance", [math.nan, math.inf])
def test_no_distance_no_rate_no_count(distance: float) -> None:
    found = status.status_of(message(clearance=distance, period_ns=0, allocations=-1))
    assert (found.clearance, found.rate_hz, found.allocations) == (None, 0.0, None)
    json.dumps(found.to_json(), allow_nan=False)


# --- who is heard ---


def sender(*messages: Any, program: str = "controller") -> watch.Sender:
    made = watch.Sender(program)
    for one in messages:
        made.take(one, time.monotonic())
    return made


def test_the_rate_is_that_of_the_last_second() -> None:
    assert sender(message()).measured_hz is None
    # Two seconds at 100 Hz, then two at 500 Hz, 20 messages a second.
    messages, ticks = [], 0
    for k in range(80):
        ticks += 5 if k < 40 else 25
        messages.append(message(mono_ns=k * 50_000_000, ticks=ticks))
    assert sender(*messages).measured_hz == pytest.approx(500)
    assert sender(*messages[:40]).measured_hz == pytest.approx(100)


def shown(*senders: watch.Sender) -> str:
    console = Console(width=80, record=True, file=None)
    with console.capture() as captured:
        console.print(watch.table(list(senders)))
    return captured.get()


def test_the_table_fits_a_small_terminal_and_names_things() -> None:
    t = wire.status_t
    refused = [0] * t.NREASONS
    refused[t.NO_NUMBER] = 12
    controller = sender(message(faults=t.PEER_TIMEOUT | t.OVERRUN, realtime=t.FIFO | t.AWAKE))
    plant = sender(message(refused=refused, session=123), program="simulator")
    text = shown(controller, plant)
    lines = text.splitlines()
    assert len(lines) < 24
    assert lines[0].split() == ["controller", "simulator"]
    assert "peer timeout, overrun" in text
    assert "fifo, awake" in text
    assert "no number 12" in text


def test_two_of_a_kind_are_told_apart() -> None:
    heading = shown(sender(message(session=71234)), sender(message(session=75678)))
    assert "..1234" in heading.splitlines()[0]
    assert "..5678" in heading.splitlines()[0]


def test_a_program_that_fell_silent_is_shown_so() -> None:
    quiet = sender(message())
    assert "silent" not in shown(quiet)
    quiet.heard -= 3
    assert "silent for 3 s, was" in " ".join(shown(quiet).split())


@contextmanager
def published(channel: str, *payloads: bytes) -> Iterator[None]:
    """Publish payloads again and again, 20 times a second."""
    done = threading.Event()

    def send() -> None:
        bus = lcm.LCM(resolve_url(None))
        while not done.wait(0.05):
            for payload in payloads:
                bus.publish(channel, payload)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def ask(*options: str) -> Any:
    return CliRunner().invoke(app, ["status", *options])


@pytest.mark.usefixtures("private_network")
def test_hostile_messages_do_not_disturb() -> None:
    good = message(session=5).encode()
    other = bytes(8) + good[8:]  # another type
    with published("STATUS", b"", b"x", other, good[:40], good + b"x", good):
        result = ask("--json")
    assert result.exit_code == 0, result.output
    assert [p["session"] for p in json.loads(result.stdout)["programs"]] == [5]


@pytest.mark.usefixtures("private_network")
def test_messages_of_another_version_are_named_as_the_cause() -> None:
    with published("PLANT_STATUS", bytes(8) + message().encode()[8:]):
        result = ask()
    assert result.exit_code == 1
    assert "status messages of another version" in result.stderr


@pytest.mark.usefixtures("private_network")
def test_many_senders_do_not_pile_up() -> None:
    ear = watch.Ear(resolve_url(None), None)
    hear = ear._handler("controller")
    for session in range(1, 1001):
        hear("STATUS", message(session=session).encode())
    assert [s.status.session for s in ear.senders] == list(range(995, 1001))
    for one in ear.senders:
        one.heard -= watch.FORGET_S
    assert ear.senders == []


@pytest.mark.usefixtures("private_network")
def test_nobody_heard_is_said_within_two_seconds() -> None:
    start = time.monotonic()
    result = ask()
    assert time.monotonic() - start < 2.5
    assert result.exit_code == 1
    assert "no controller and no simulator was heard" in result.stderr
    assert "leeway run SCENE" in result.stderr


def test_watching_needs_a_terminal() -> None:
    for options in ([], ["--json"], ["--quiet"]):
        assert ask("--watch", *options).exit_code == 2
