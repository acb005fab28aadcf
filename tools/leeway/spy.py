"""Starting lcm-spy with Leeway's types and its obstacle dialog, or saying what it lacks."""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Mapping
from pathlib import Path

from leeway import bus
from leeway.doctor import programs
from leeway.doctor.machine import OK, Machine
from leeway.processes import program

X_SOCKETS = "/tmp/.X11-unix/X"
X_PORT = 6000
CONNECT_PATIENCE_S = 2.0


class SpyMissing(Exception):
    """Something that lcm-spy needs is not there; the text says what to do."""


def _addresses(display: str) -> list[tuple[int, str | tuple[str, int]]]:
    """Return where the X server of a DISPLAY listens, by socket family."""
    found = re.fullmatch(r"(?:unix)?(.*):(\d+)(?:\.\d+)?", display)
    if found is None:
        return []
    host, number = found[1].removesuffix("/"), int(found[2])
    if host:
        return [(socket.AF_INET, (host, X_PORT + number))]
    return [(socket.AF_UNIX, f"{name}{number}") for name in (f"\0{X_SOCKETS}", X_SOCKETS)]


def _answers(family: int, address: str | tuple[str, int]) -> bool:
    with socket.socket(family, socket.SOCK_STREAM) as trial:
        trial.settimeout(CONNECT_PATIENCE_S)
        try:
            trial.connect(address)
        except (OSError, OverflowError):
            return False
    return True


def check_display(display: str) -> None:
    """Raise SpyMissing unless an X server answers at a DISPLAY."""
    advice = "start it in a graphical session, or over ssh with ssh -X"
    if not display:
        raise SpyMissing(f"no display: lcm-spy opens a window, and DISPLAY is not set: {advice}")
    if not any(_answers(*address) for address in _addresses(display)):
        raise SpyMissing(f"no display: nothing answers at DISPLAY={display}: {advice}")


def environment(url: str, robot: str | None, jar: Path, given: Mapping[str, str]) -> dict[str, str]:
    """Return what lcm-spy and the plugin read; a class path of one's own stays, behind ours."""
    classes = [str(jar), given.get("CLASSPATH", "")]
    # With -l in place of the variable the plugin would send on another bus than spy shows.
    return {
        **given,
        "LCM_DEFAULT_URL": url,
        "CLASSPATH": os.pathsep.join(part for part in classes if part),
        "LEEWAY_NAME": robot or "",
    }


def prepare(url: str | None, robot: str | None) -> tuple[list[str], dict[str, str]]:
    """Check all that lcm-spy needs.

    Returns
    -------
    Its command and its environment.

    Raises
    ------
    SpyMissing, ProgramMissing, BusError
        The text says what is missing and how to get it.
    """
    resolved = bus.resolve_url(url)
    bus.open_bus(resolved).close()
    machine = Machine()
    # The jar first: the JDK that builds it brings a Java with windows as well.
    for check in (programs.spy_plugin, programs.java):
        found = check(machine)
        if found.kind != OK:
            raise SpyMissing(f"{found.text}: {found.fix}")
    check_display(os.environ.get("DISPLAY", ""))
    # The script itself, which becomes the Java process; .venv/bin/lcm-spy would stay its parent.
    command = [str(program("lcm-spy")), *(["--title", robot] if robot else [])]
    return command, environment(resolved, robot, program(programs.SPY_JAR), os.environ)
