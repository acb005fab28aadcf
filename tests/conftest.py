"""What all Python tests share: paths, golden data, a private network for the bus."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

# A shell's background jobs ignore Ctrl-C, and so would every program that the tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[1]
CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000


@pytest.fixture(scope="session")
def root() -> Path:
    """Folder of the project."""
    return ROOT


@pytest.fixture(scope="session")
def golden() -> Callable[[str], Any]:
    """Reader of a golden file by name."""
    return lambda name: json.loads((ROOT / "tests" / "data" / name).read_text())


def _map_user(uid: int, gid: int) -> None:
    """Keep this user's identity as root of its new user namespace."""
    Path("/proc/self/setgroups").write_text("deny")
    Path("/proc/self/uid_map").write_text(f"0 {uid} 1")
    Path("/proc/self/gid_map").write_text(f"0 {gid} 1")


@pytest.fixture
def private_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Move this process into a network of its own, lo with multicast: a fresh, empty bus."""
    user, group = os.geteuid(), os.getegid()
    libc = ctypes.CDLL(None, use_errno=True)
    flags = CLONE_NEWNET if user == 0 else CLONE_NEWUSER | CLONE_NEWNET
    if libc.unshare(flags) != 0:
        pytest.skip(f"no private network namespace here: {os.strerror(ctypes.get_errno())}")
    if user != 0:
        _map_user(user, group)
    for command in (
        "ip link set lo up",
        "ip link set lo multicast on",
        "ip route add 224.0.0.0/4 dev lo",
    ):
        subprocess.run(command.split(), check=True)
    monkeypatch.delenv("LCM_DEFAULT_URL", raising=False)
