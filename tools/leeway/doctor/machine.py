"""What the doctor looks at, and what it says: a machine behind readers that tests replace."""

from __future__ import annotations

import gzip
import os
import secrets
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

OK, WARNING, PROBLEM = "ok", "warning", "problem"
COMMAND_PATIENCE_S = 10.0
LOOPBACK_PATIENCE_S = 1.0
CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23
WHOLE_MACHINE = "4294967295"  # users in a map that is no user namespace


@dataclass(frozen=True)
class Finding:
    """One line for people: what was found and, unless all is well, the command that mends it."""

    kind: str
    text: str
    fix: str = ""


@dataclass(frozen=True)
class Ran:
    """How a command ended and what it said on both streams; status 127 when there is none."""

    status: int
    output: str


def run_command(command: Sequence[str]) -> Ran:
    """Run a command to its end, within a bound."""
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=COMMAND_PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Ran(127, str(error))
    return Ran(done.returncode, done.stdout.decode(errors="replace").strip())


def try_fifo(priority: int) -> bool:
    """Whether the system gives a thread of this process SCHED_FIFO at a priority."""
    granted = []

    def trial() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
            granted.append(True)
        except OSError:
            pass

    # Linux changes the calling thread alone: this one ends with its priority.
    thread = threading.Thread(target=trial)
    thread.start()
    thread.join()
    return bool(granted)


def multicast_round(group: str) -> float:
    """Send one datagram to a multicast group at a free port, and receive it.

    Returns
    -------
    Time from sending to receiving, s.

    Raises
    ------
    OSError
        It cannot be sent, or does not arrive within 1 s (TimeoutError).
    """
    token = secrets.token_bytes(16)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind((group, 0))
        # The interface that the kernel would choose, as LCM has it.
        membership = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        start = time.perf_counter()
        sender.sendto(token, receiver.getsockname())
        # Others may send to this port too: wait for our own datagram.
        while (left := start + LOOPBACK_PATIENCE_S - time.perf_counter()) > 0:
            receiver.settimeout(left)
            if receiver.recv(64) == token:
                return time.perf_counter() - start
    raise TimeoutError("timed out")


def _own_folders() -> tuple[Path, ...]:
    """Folders that hold LCM's tools as Leeway installs them."""
    from leeway import _native

    return (Path(sys.prefix) / "bin", Path(_native.__file__).parent.parent / "bin")


@dataclass(frozen=True)
class Machine:
    """The machine as the checks see it; every reader can be replaced."""

    root: Path = Path("/")
    group: str = "239.255.76.67"
    path: str = field(default_factory=lambda: os.environ.get("PATH", ""))
    user: int = field(default_factory=os.geteuid)
    own_folders: tuple[Path, ...] = field(default_factory=_own_folders)
    run: Callable[[Sequence[str]], Ran] = run_command
    try_fifo: Callable[[int], bool] = try_fifo
    multicast_round: Callable[[str], float] = multicast_round
    may_write: Callable[[Path], bool] = field(default=lambda path: os.access(path, os.W_OK))

    def read(self, name: str) -> str | None:
        """Return the text of a file, unpacked when its name ends in .gz; None when unreadable."""
        try:
            data = (self.root / name).read_bytes()
            text = gzip.decompress(data) if name.endswith(".gz") else data
        except (OSError, EOFError):
            return None
        return text.decode(errors="replace").strip()

    def number(self, name: str) -> int | None:
        """Return the number in a file, None when there is none."""
        try:
            return int(self.read(name) or "", 0)
        except ValueError:
            return None

    def limit(self, title: str) -> float:
        """Return this process's soft limit by its title in /proc/self/limits; 0 when unknown."""
        for line in (self.read("proc/self/limits") or "").splitlines():
            if line.startswith(title):
                value = line[len(title) :].split()[0]
                return float("inf") if value == "unlimited" else float(value)
        return 0.0

    def capable(self, capability: int) -> bool:
        """Whether this process has a capability of the machine, not of a user namespace."""
        if (self.read("proc/self/uid_map") or WHOLE_MACHINE).split()[-1] != WHOLE_MACHINE:
            return False
        for line in (self.read("proc/self/status") or "").splitlines():
            if line.startswith("CapEff:"):
                return bool(int(line.split()[1], 16) >> capability & 1)
        return False
