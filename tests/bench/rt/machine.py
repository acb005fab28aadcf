"""What a measurement has to say about the machine it was made on."""

from __future__ import annotations

import gzip
import os
import platform
import re
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PACKAGES = {"cyclictest": "rt-tests", "stress-ng": "stress-ng"}


def describe() -> dict[str, Any]:
    """Return kernel, preemption model, CPUs and the versions of the tools measured against."""
    cpu = _text("/proc/cpuinfo")
    model = re.search(r"^model name\s*: (.*)$", cpu, re.M)
    return {
        "kernel": f"{platform.system()} {platform.release()} {platform.version()}",
        "preemption": preemption(),
        "cpus": len(os.sched_getaffinity(0)),
        "cpu": model[1] if model else platform.machine(),
        "virtual": bool(re.search(r"^flags\s*:.*\bhypervisor\b", cpu, re.M)),
        "sched_rt_runtime_us": _text("/proc/sys/kernel/sched_rt_runtime_us").strip(),
        "cyclictest": _version("cyclictest", "--help"),
        "stress-ng": _version("stress-ng", "--version"),
    }


def preemption() -> str:
    """Name the kernel's preemption model."""
    version = platform.version()
    if "PREEMPT_RT" in version or _text("/sys/kernel/realtime").strip() == "1":
        return "PREEMPT_RT"
    if "PREEMPT_DYNAMIC" in version:
        return f"PREEMPT_DYNAMIC, {_dynamic()}"
    return "PREEMPT" if "PREEMPT" in version else "none or voluntary"


def _dynamic() -> str:
    """Return what PREEMPT_DYNAMIC is set to: by its own word, boot option or build option."""
    chosen = re.search(r"\((\w+)\)", _text("/sys/kernel/debug/sched/preempt"))
    if chosen:
        return chosen[1]
    booted = re.search(r"\bpreempt=(\w+)", _text("/proc/cmdline"))
    if booted:
        return f"{booted[1]} (boot option)"
    for name in ("NONE", "VOLUNTARY", "LAZY", ""):
        option = f"CONFIG_PREEMPT_{name}".rstrip("_")
        if re.search(rf"^{option}=y$", _build_options(), re.M):
            return f"{name.lower() or 'full'} (build default)"
    return "unknown"


def _build_options() -> str:
    with suppress(OSError):
        return gzip.decompress(Path("/proc/config.gz").read_bytes()).decode()
    return _text(f"/boot/config-{platform.release()}")


def _text(path: str) -> str:
    """Text of a file, empty where this machine has none or keeps it to itself."""
    with suppress(OSError):
        return Path(path).read_text()
    return ""


def _version(tool: str, option: str) -> str:
    """First line with a version that a tool prints."""
    result = subprocess.run([tool, option], capture_output=True, text=True, check=False)
    found = re.search(r"(?:V|version) ?([\d.]+\d)", result.stdout + result.stderr)
    return found[1] if found else "unknown"


@contextmanager
def kept_awake() -> Iterator[bool]:
    """Keep the CPUs out of deep sleep, as cyclictest and our programs do for themselves."""
    try:
        file = os.open("/dev/cpu_dma_latency", os.O_RDWR)
    except OSError:
        yield False
        return
    try:
        os.write(file, struct.pack("i", 0))
        yield True
    finally:
        os.close(file)


def receivers(port: int) -> int:
    """Count the sockets of this network that hear a UDP port."""
    lines = _text("/proc/net/udp").splitlines()[1:]
    return sum(line.split()[1].endswith(f":{port:04X}") for line in lines)
