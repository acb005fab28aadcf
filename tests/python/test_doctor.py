"""The doctor: every check says ok, warning or problem when the machine is so."""

from __future__ import annotations

import gzip
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from leeway import cli_machine, doctor
from leeway.cli import app
from leeway.doctor import network, programs, timing
from leeway.doctor.machine import Finding, Machine, Ran, multicast_round, run_command, try_fifo

LIMITS = "Max locked memory  {lock}  {lock}  bytes\nMax realtime priority  {prio}  {prio}  \n"
NOBODY = {
    "proc/self/limits": LIMITS.format(lock=8388608, prio=0),
    "proc/self/status": "Name: x\nCapEff:\t0000000000000000\n",
    "proc/self/uid_map": "0 0 4294967295\n",
}
# What a machine in good order shows; each case below changes one thing.
FILES = {
    **NOBODY,
    "proc/self/limits": LIMITS.format(lock="unlimited", prio=90),
    "proc/sys/net/core/rmem_max": "2097152\n",
    "proc/sys/net/core/rmem_default": "212992\n",
    "proc/sys/kernel/version": "#1 SMP PREEMPT_RT\n",
    "proc/sys/kernel/osrelease": "6.1.0\n",
    "proc/sys/kernel/sched_rt_runtime_us": "950000\n",
    "proc/sys/kernel/sched_rt_period_us": "1000000\n",
    "sys/class/net/lo/flags": "0x1009\n",
    f"{timing.CLOCK}/current_clocksource": "tsc\n",
    f"{timing.CLOCK}/available_clocksource": "tsc acpi_pm\n",
    "sys/devices/system/cpu/isolated": "\n",
    timing.DMA_LATENCY: "",
}
GOVERNOR = "sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor"
DYNAMIC = {"proc/sys/kernel/version": "#1 SMP PREEMPT_DYNAMIC"}


def answers(replies: dict[str, Ran]) -> Callable[[Sequence[str]], Ran]:
    """Reply to a command by the first word that the table knows in it."""

    def run(command: Sequence[str]) -> Ran:
        line = " ".join(map(str, command))
        return next((reply for key, reply in replies.items() if key in line), Ran(0, ""))

    return run


COMMANDS = {"route get": Ran(0, "multicast 239.255.76.67 dev lo uid 0"), "ip -V": Ran(0, "ip")}


def machine(root: Path, files: dict[str, str | None] | None = None, **readers: Any) -> Machine:
    """Build a machine in good order, some files replaced or (None) left out."""
    for name, text in {**FILES, **(files or {})}.items():
        if text is None:
            continue
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        packed = name.endswith(".gz")
        path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    usual: dict[str, Any] = {
        "user": 1000,
        "path": "",
        "own_folders": (root / "own",),
        "run": answers(COMMANDS),
        "try_fifo": lambda _: True,
        "multicast_round": lambda _: 30e-6,
        "may_write": lambda _: True,
    }
    return Machine(root=root, **{**usual, **readers})


def refuse(error: OSError) -> Callable[[str], float]:
    def round_trip(_: str) -> float:
        raise error

    return round_trip


CASES: list[tuple[Any, dict[str, str | None], dict[str, Any], str, str]] = [
    # check, files, readers, kind, what text or fix says
    (network.route, {}, {}, "ok", "dev lo"),
    (
        network.route,
        {},
        {"run": answers({"get": Ran(2, "unreachable")})},
        "problem",
        "route add 224",
    ),
    (network.route, {}, {"run": answers({"ip -V": Ran(127, "")})}, "warning", "iproute2"),
    (network.loopback_flag, {}, {}, "ok", "on"),
    (network.loopback_flag, {"sys/class/net/lo/flags": "0x9"}, {}, "warning", "lo multicast on"),
    (
        network.loopback_flag,
        {"sys/class/net/lo/flags": "0x9"},
        {"run": answers({"get": Ran(0, "239.255.76.67 dev eth0")})},
        "ok",
        "not needed",
    ),
    (network.loopback_flag, {"sys/class/net/lo/flags": None}, {}, "warning", "cannot be read"),
    (network.multicast, {}, {}, "ok", "30 us"),
    (network.multicast, {}, {"multicast_round": refuse(TimeoutError())}, "problem", "iptables"),
    (
        network.multicast,
        {},
        {"multicast_round": refuse(OSError(101, "Network is unreachable"))},
        "problem",
        "Network is unreachable",
    ),
    (network.receive_buffer, {}, {}, "ok", "2097152"),
    (network.receive_buffer, {"proc/sys/net/core/rmem_max": "2097151"}, {}, "warning", "=2097152"),
    (
        network.receive_buffer,
        {"proc/sys/net/core/rmem_default": "4096"},
        {},
        "warning",
        "rmem_default=212992",
    ),
    (network.receive_buffer, {"proc/sys/net/core/rmem_max": None}, {}, "warning", "cannot be read"),
    (network.namespaces, {}, {}, "ok", "private"),
    (
        network.namespaces,
        {"proc/sys/kernel/apparmor_restrict_unprivileged_userns": "1"},
        {"run": answers({"unshare -rn": Ran(1, "no")})},
        "warning",
        "kernel.apparmor_restrict_unprivileged_userns=0",
    ),
    (
        network.namespaces,
        {"proc/sys/kernel/unprivileged_userns_clone": "0"},
        {"run": answers({"unshare": Ran(1, "no")})},
        "warning",
        "kernel.unprivileged_userns_clone=1",
    ),
    (
        network.namespaces,
        {},
        {"run": answers({"unshare -n": Ran(1, "no")}), "user": 0},
        "warning",
        "SYS_ADMIN",
    ),
    (timing.fifo, {}, {}, "ok", "SCHED_FIFO 80"),
    (timing.fifo, NOBODY, {"try_fifo": lambda _: False}, "warning", "rtprio 90"),
    (timing.fifo, NOBODY, {"try_fifo": lambda _: False, "user": 0}, "warning", "--cap-add=SYS_N"),
    (timing.fifo, {}, {"try_fifo": lambda _: False}, "warning", "sched_rt_runtime_us=-1"),
    (timing.memory_lock, {}, {}, "ok", "no limit"),
    (timing.memory_lock, NOBODY, {}, "warning", "memlock unlimited"),
    (timing.memory_lock, NOBODY, {"user": 0}, "warning", "--cap-add=IPC_LOCK"),
    (
        timing.memory_lock,
        {"proc/self/limits": LIMITS.format(lock=1 << 30, prio=0)},
        {},
        "ok",
        "1024 MiB",
    ),
    (
        timing.memory_lock,
        {**NOBODY, "proc/self/status": "CapEff:\t0000000000004000"},
        {},
        "ok",
        "no limit",
    ),
    # In a user namespace the same bit means nothing outside.
    (
        timing.memory_lock,
        {
            **NOBODY,
            "proc/self/status": "CapEff:\t0000000000004000",
            "proc/self/uid_map": "0 1000 1",
        },
        {},
        "warning",
        "8192 kB",
    ),
    (timing.throttling, {}, {}, "ok", "950000 of each 1000000 us"),
    (timing.throttling, {"proc/sys/kernel/sched_rt_runtime_us": "-1"}, {}, "ok", "off"),
    (
        timing.throttling,
        {"proc/sys/kernel/sched_rt_runtime_us": "400000"},
        {},
        "warning",
        "sched_rt_runtime_us=950000",
    ),
    (timing.throttling, {"proc/sys/kernel/sched_rt_runtime_us": None}, {}, "warning", "cannot be"),
    (timing.governor, {}, {}, "ok", "none here"),
    (timing.governor, {GOVERNOR.format(0): "performance"}, {}, "ok", "performance"),
    (
        timing.governor,
        {GOVERNOR.format(0): "performance", GOVERNOR.format(11): "powersave"},
        {},
        "warning",
        "powersave",
    ),
    (timing.clock_source, {}, {}, "ok", "tsc"),
    (timing.clock_source, {f"{timing.CLOCK}/current_clocksource": "kvm-clock"}, {}, "ok", "kvm"),
    (timing.clock_source, {f"{timing.CLOCK}/current_clocksource": "hpet"}, {}, "warning", "tsc |"),
    (
        timing.clock_source,
        {
            f"{timing.CLOCK}/current_clocksource": "acpi_pm",
            f"{timing.CLOCK}/available_clocksource": "acpi_pm",
        },
        {},
        "warning",
        "tsc=reliable",
    ),
    (timing.clock_source, {f"{timing.CLOCK}/current_clocksource": None}, {}, "warning", "cannot"),
    (timing.idle_states, {}, {}, "ok", "writable"),
    (timing.idle_states, {}, {"may_write": lambda _: False}, "warning", "udevadm"),
    (timing.idle_states, {timing.DMA_LATENCY: None}, {}, "ok", "decides alone"),
    (timing.isolated, {}, {}, "ok", "none"),
    (timing.isolated, {"sys/devices/system/cpu/isolated": "2-3"}, {}, "ok", "2-3"),
    (timing.preemption, {}, {}, "ok", "PREEMPT_RT"),
    (
        timing.preemption,
        {**DYNAMIC, timing.PREEMPT_SWITCH: "none voluntary (full) lazy"},
        {},
        "ok",
        "full (from /sys/kernel/debug/sched/preempt)",
    ),
    (
        timing.preemption,
        {**DYNAMIC, timing.PREEMPT_SWITCH: "none (voluntary) full"},
        {},
        "warning",
        "echo full | sudo tee",
    ),
    # The kernel's command line outdoes what it was built with; the last word counts.
    (
        timing.preemption,
        {
            **DYNAMIC,
            "proc/cmdline": "preempt=none quiet preempt=full",
            "boot/config-6.1.0": "CONFIG_PREEMPT_NONE=y",
        },
        {},
        "ok",
        "full (from /proc/cmdline; /sys/kernel/debug/sched/preempt cannot be read)",
    ),
    (
        timing.preemption,
        {**DYNAMIC, "proc/config.gz": "CONFIG_PREEMPT_NONE=y\nCONFIG_PREEMPT_DYNAMIC=y"},
        {"user": 0},
        "warning",
        "add preempt=full",
    ),
    (
        timing.preemption,
        {
            "proc/sys/kernel/version": "#1 SMP Debian",
            "boot/config-6.1.0": "CONFIG_PREEMPT_VOLUNTARY=y",
            "etc/os-release": "ID=debian",
        },
        {},
        "warning",
        "linux-image-rt-",
    ),
    (timing.preemption, {"proc/sys/kernel/version": "#1 SMP PREEMPT"}, {}, "ok", "full"),
    (timing.preemption, {"proc/sys/kernel/version": "#1 SMP"}, {}, "warning", "unknown"),
]


@pytest.mark.parametrize(("check", "files", "readers", "kind", "said"), CASES)
def test_a_check_says_what_it_should(
    tmp_path: Path,
    check: Callable[[Machine], Finding],
    files: dict[str, str | None],
    readers: dict[str, Any],
    kind: str,
    said: str,
) -> None:
    found = check(machine(tmp_path, files, **readers))
    assert found.kind == kind, found
    assert said in f"{found.text}\n{found.fix}"
    assert bool(found.fix) == (kind != "ok")


# --- programs ---


def executable(path: Path) -> Path:
    """Make an empty program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(mode=0o755)
    return path


def java_says(version: str, home: str = "/jvm") -> dict[str, Ran]:
    return {
        "java": Ran(0, f"Property settings:\n    java.home = {home}\n    java.version = {version}")
    }


@pytest.mark.parametrize(
    ("version", "window", "kind", "said"),
    [
        ("17.0.15", "lib", "ok", "17.0.15"),
        ("1.8.0_412", "lib/amd64", "ok", "1.8"),
        ("1.7.0_80", "lib/amd64", "warning", "too old"),
        ("17.0.15", None, "warning", "headless"),
    ],
)
def test_java(tmp_path: Path, version: str, window: str | None, kind: str, said: str) -> None:
    executable(tmp_path / "bin/java")
    if window:
        executable(tmp_path / "jvm" / window / "libawt_xawt.so")
    here = machine(tmp_path, path=str(tmp_path / "bin"), run=answers(java_says(version)))
    found = programs.java(here)
    assert (found.kind, bool(found.fix)) == (kind, kind != "ok")
    assert said in found.text


def test_no_java(tmp_path: Path) -> None:
    assert programs.java(machine(tmp_path)).fix == programs.INSTALL_JAVA
    executable(tmp_path / "bin/java")
    broken = machine(tmp_path, path=str(tmp_path / "bin"), run=answers({"java": Ran(1, "")}))
    assert "does not start" in programs.java(broken).text


@pytest.mark.parametrize(
    ("folder", "version", "kind", "said"),
    [
        ("own", "", "ok", "Leeway's"),
        ("usr/bin", "lcm-gen 1.3.1", "warning", "LCM 1.3.1 in "),
        ("usr/bin", "lcm-gen 1.5.2", "ok", "LCM 1.5.2"),
        ("usr/bin", "?", "warning", "unknown version"),
    ],
)
def test_lcm_tools_on_the_path(
    tmp_path: Path, folder: str, version: str, kind: str, said: str
) -> None:
    executable(tmp_path / folder / "lcm-logger")
    executable(tmp_path / "own/lcm-logger")
    path = f"{tmp_path / folder}:{tmp_path / 'own'}"
    found = programs.lcm_on_path(
        machine(tmp_path, path=path, run=answers({"lcm-gen": Ran(0, version)}))
    )
    assert found.kind == kind, found
    assert said in found.text


def test_programs_that_do_not_start_are_a_problem(tmp_path: Path) -> None:
    assert programs.programs(machine(tmp_path)).kind == "ok"
    assert programs.programs(machine(tmp_path, run=run_command)).kind == "ok"
    lost = Ran(127, "error while loading shared libraries: libglib-2.0.so.0")
    found = programs.programs(machine(tmp_path, run=answers({"leeway-simulator": lost})))
    assert found.kind == "problem"
    assert "leeway-simulator does not start: error while" in found.text


def test_an_old_lcm_is_a_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert programs.lcm_version(machine(tmp_path)).kind == "ok"
    monkeypatch.setattr(programs.metadata, "version", lambda _: "1.3.1")
    assert programs.lcm_version(machine(tmp_path)).kind == "problem"
    monkeypatch.setitem(sys.modules, "lcm", None)
    assert "libglib2.0-0" in programs.lcm_version(machine(tmp_path)).fix


# --- what is measured ---


@pytest.mark.usefixtures("private_network")
def test_multicast_is_measured() -> None:
    assert 0 < multicast_round("239.255.76.67") < 1
    subprocess.run(["ip", "route", "del", "224.0.0.0/4"], check=True)
    with pytest.raises(OSError, match=r"No such device|unreachable"):
        multicast_round("239.255.76.67")


def test_fifo_is_tried_in_a_thread_of_its_own() -> None:
    granted = try_fifo(1)
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    # The same question put to another process.
    chrt = run_command(["chrt", "--fifo", "1", "true"])
    assert granted == (chrt.status == 0)
    assert not try_fifo(100)


def test_a_command_that_is_missing_has_a_status() -> None:
    assert run_command(["no-such-command-here"]).status == 127
    assert run_command(["sh", "-c", "echo said >&2; exit 3"]) == Ran(3, "said")


# --- the command ---


def _doctor(monkeypatch: pytest.MonkeyPatch, here: Machine, *options: str) -> Any:
    monkeypatch.setattr(doctor, "Machine", lambda group: here)
    return CliRunner().invoke(app, ["doctor", *options])


def test_the_command_fails_with_a_problem_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warned = _doctor(monkeypatch, machine(tmp_path, NOBODY))
    assert warned.exit_code == 0
    assert "warning  memory locking is limited to 8192 kB\n" in warned.stdout
    assert "           echo" in warned.stdout
    unroutable = machine(tmp_path, run=answers({**COMMANDS, "route get": Ran(2, "")}))
    failed = _doctor(monkeypatch, unroutable)
    assert failed.exit_code == 1
    quiet = _doctor(monkeypatch, unroutable, "--quiet")
    assert [line.split()[0] for line in quiet.stdout.splitlines()] == ["problem", "sudo"]


def test_json_is_one_document(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = machine(tmp_path, NOBODY, multicast_round=refuse(TimeoutError()))
    result = _doctor(monkeypatch, broken, "--json")
    found = json.loads(result.stdout)
    assert result.exit_code == found["problems"] == 1
    kinds = {row["check"]: row["kind"] for row in found["findings"]}
    assert set(kinds) == set(doctor.CHECKS)
    assert kinds["multicast"] == "problem"
    assert kinds["memory_lock"] == "warning"
    assert found["warnings"] == list(kinds.values()).count("warning")


def test_the_group_is_that_of_the_bus() -> None:
    assert cli_machine._group("udpm://239.1.2.3:7000") == "239.1.2.3"
    assert CliRunner().invoke(app, ["doctor", "--lcm-url", "file://x"]).exit_code == 2
