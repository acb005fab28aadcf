"""One run: lcm-logger, simulator and controller as processes, watched and stopped in order."""

from __future__ import annotations

import errno
import itertools
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from leeway_lcm import leeway as wire

from leeway import bus as bus_tools
from leeway.connection import Connection
from leeway.processes import Child
from leeway.scene import Scene

POLL_S = 0.05
LISTEN_S = 0.3
LOGGER_PATIENCE_S = 5.0
MARK_REACH = 1 << 16  # bytes from the end of the log in which a mark is looked for
START_PATIENCE_S = 15.0
REST_PATIENCE_S = 2.0
NEVER_MOVED = -1.0
PACE = 3000
LOG_FOLDER = Path("runs")


class RunFailed(Exception):
    """The run ended before its scene did; the text says what happened."""


class Interrupted(Exception):
    """Ctrl-C, after everything was stopped in order."""


@dataclass
class RunConfig:
    """What to run."""

    scene: Scene
    path: Path
    log: Path
    sets: list[str] = field(default_factory=list)
    lockstep: bool = False
    url: str | None = None
    name: str | None = None
    pace: int = PACE  # messages a second in lockstep


class _Interrupt:
    """Turns SIGINT, SIGTERM and SIGHUP into a flag for the life of a run."""

    def __enter__(self) -> _Interrupt:
        self.requested = False
        stops = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        self._old = {s: signal.signal(s, self._note) for s in stops}
        return self

    def _note(self, _: int, __: FrameType | None) -> None:
        self.requested = True

    def __exit__(self, *_: object) -> None:
        for number, handler in self._old.items():
            signal.signal(number, handler)


class _Watch:
    """Follows the arm on the bus: time of motion and whether it moves."""

    def __init__(self, bus: Connection, name: str | None) -> None:
        self.bus = bus
        self.motion_s = NEVER_MOVED
        self.at_rest = True
        self._sessions: set[int] = set()
        bus.subscribe(bus_tools.channel("JOINT_STATE", name), self._on_state)

    def _on_state(self, _: str, data: bytes) -> None:
        state = bus_tools.decode(wire.joint_state_t, data)
        if state is None:
            return
        self.motion_s = state.tick * state.period_ns * 1e-9
        self.at_rest = all(v == 0 for v in state.qd)
        self._sessions.add(state.h.session)

    @property
    def plants(self) -> int:
        """Number of plants heard."""
        return len(self._sessions)

    def wait(self) -> None:
        """Handle what comes in the next moment."""
        self.bus.handle(POLL_S)


def take_log_name(scene: str) -> Path:
    """Make an empty log named after the scene and now, with -2 and so on when that is taken.

    Raises
    ------
    OSError
        The folder or the file cannot be made.
    """
    stem = f"{scene}-{time.strftime('%Y%m%d-%H%M%S')}"
    LOG_FOLDER.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        path = LOG_FOLDER / f"{stem}{f'-{number}' if number > 1 else ''}.lcm"
        with suppress(FileExistsError):
            path.touch(exist_ok=False)
            break
    return path


def drop_empty(log: Path) -> None:
    """Give a name back that `take_log_name` took and nothing was recorded under."""
    if log.exists() and log.stat().st_size == 0:
        log.unlink()


def run(config: RunConfig, progress: Callable[[float], None] | None = None) -> float:
    """Run a scene as processes and record it.

    Parameters
    ----------
    progress
        Called with the time of motion, s.

    Returns
    -------
    Wall time of the motion, s.

    Raises
    ------
    bus.BusError
        There is no usable bus; nothing was started.
    RunFailed
        A process ended early or never moved; everything else was stopped, the log is whole.
    Interrupted
        Ctrl-C; the controller was asked to brake, everything was stopped, the log is whole.
    OSError
        The log cannot be written; nothing was started.
    """
    url = bus_tools.resolve_url(config.url)
    bus = bus_tools.open_bus(url)
    children: list[Child] = []
    with _Interrupt() as interrupt:
        try:
            _refuse_company(bus_tools.open_bus(url), config.name)
            _start(config, url, bus, children)
            return _watch(config, bus, children, interrupt, progress)
        finally:
            _stop(config, bus, children)


def _refuse_company(bus: Connection, name: str | None) -> None:
    """Listen for a moment; two plants or controllers on one bus would mix their messages."""
    heard: list[str] = []
    for channel in ("JOINT_STATE", "JOINT_COMMAND"):
        bus.subscribe(bus_tools.channel(channel, name), lambda found, _: heard.append(found))
    end = time.monotonic() + LISTEN_S
    while not heard and (left := end - time.monotonic()) > 0:
        bus.handle(left)
    if heard:
        raise RunFailed(
            f"another run is on this bus ({heard[0]} heard): stop it, or use another "
            "--lcm-url port or --name"
        )


def _start(config: RunConfig, url: str, bus: Connection, children: list[Child]) -> None:
    """Start logger, simulator, controller; the logger records before the others begin."""
    config.log.parent.mkdir(parents=True, exist_ok=True)
    if config.log.exists() and not config.log.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(config.log))
    # An old log would pass for the new one's first event; an empty one keeps the name.
    if config.log.exists() and config.log.stat().st_size > 0:
        config.log.unlink()
    # A recorder that waits for the processor loses what its short queue cannot hold.
    logger = Child("lcm-logger", "-q", "-f", f"--lcm-url={url}", str(config.log), ahead=True)
    children.append(logger)
    _wait_for_logger(logger, bus, config.log)
    args = [str(config.path), f"--lcm-url={url}"]
    args += [f"--set={one}" for one in config.sets]
    args += ["--lockstep"] if config.lockstep else []
    args += [f"--name={config.name}"] if config.name else []
    pace = f"--pace={config.pace}"
    children.append(Child("leeway-simulator", "--until-done", pace, *args))
    children.append(Child("leeway-controller", f"--post-mortem={config.log.parent}", *args))


def _stop(config: RunConfig, bus: Connection, children: list[Child]) -> None:
    """Stop the controller, which brakes the arm; then the plant; the recorder last."""
    for child in reversed(children[1:]):
        child.stop()
    if children:
        _wait_for_mark(children[0], bus, config.log)
        children[0].stop()


def _wait_for_mark(logger: Child, bus: Connection, log: Path) -> None:
    """Wait until the log holds a mark published last: lcm-logger drops its backlog at its end."""
    mark = f"leeway run ends {bus_tools.new_session()}\n\0".encode()
    end = time.monotonic() + LOGGER_PATIENCE_S
    while logger.status() is None and time.monotonic() < end:
        bus.publish("LCM_SELF_TEST", mark)
        time.sleep(POLL_S)
        if log.exists() and mark in _tail(log):
            return


def _tail(log: Path) -> bytes:
    """Return the last bytes of a log."""
    with log.open("rb") as file:
        file.seek(-min(MARK_REACH, log.stat().st_size), os.SEEK_END)
        return file.read()


def _wait_for_logger(logger: Child, bus: Connection, log: Path) -> None:
    """Wait until the logger has written something: a probe, sent again and again."""
    end = time.monotonic() + LOGGER_PATIENCE_S
    while not (log.exists() and log.stat().st_size > 0):
        if logger.status() is not None or time.monotonic() > end:
            raise RunFailed(f"lcm-logger does not record to {log}: {logger.said() or 'no message'}")
        bus.publish("LCM_SELF_TEST", b"leeway run\n\0")
        time.sleep(POLL_S)


def _watch(
    config: RunConfig,
    bus: Connection,
    children: list[Child],
    interrupt: _Interrupt,
    progress: Callable[[float], None] | None,
) -> float:
    """Follow the run until the simulator is done; raise when anything else happens first."""
    watch = _Watch(bus, config.name)
    simulator = children[1]
    started = time.monotonic()
    # Programs warm up for half a second, and the controller listens to the plant for a few periods.
    patience = START_PATIENCE_S + 20 / float(config.scene.to_dict()["rate_hz"])
    moved: float | None = None
    while simulator.status() is None:
        watch.wait()
        if moved is None and watch.motion_s > 0:
            moved = time.monotonic()
        if progress and watch.motion_s >= 0:
            progress(watch.motion_s)
        if interrupt.requested:
            raise Interrupted(f"interrupted at t = {max(watch.motion_s, 0):.3f} s")
        _check_others(children, watch)
        if watch.plants > 1:
            raise RunFailed("a second plant came to this bus: its messages mix with this run's")
        if moved is None and time.monotonic() - started > patience:
            raise RunFailed(f"the arm did not move within {patience:g} s{_words(children)}")
    if simulator.status() != 0:
        raise RunFailed(
            f"{simulator.ending()} at t = {max(watch.motion_s, 0):.3f} s{_words([simulator])}"
        )
    return time.monotonic() - (moved or started)


def _check_others(children: list[Child], watch: _Watch) -> None:
    """Raise when logger or controller has ended; a plant left alone ramps to rest first."""
    for child in (children[0], children[2]):
        if child.status() is None:
            continue
        when = max(watch.motion_s, 0)
        end = time.monotonic() + REST_PATIENCE_S
        while child.name == "leeway-controller" and not watch.at_rest and time.monotonic() < end:
            watch.wait()
        raise RunFailed(f"{child.ending()} at t = {when:.3f} s{_words([child])}")


def _words(children: list[Child]) -> str:
    """Return what the children said, as lines to append to a message."""
    said = [line for child in children for line in child.said().splitlines()]
    return "".join(f"\n  {line}" for line in said[-8:])
