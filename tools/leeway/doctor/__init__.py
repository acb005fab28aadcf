"""The doctor: what this machine lacks for Leeway, and the command that mends it.

Each check is a function of a `Machine` that returns one `Finding`; nothing is changed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.text import Text

from leeway.doctor import network, programs, timing
from leeway.doctor.machine import OK, PROBLEM, WARNING, Finding, Machine

__all__ = ["CHECKS", "Finding", "Machine", "examine", "print_findings", "to_json"]

CHECKS: dict[str, Callable[[Machine], Finding]] = {
    "programs": programs.programs,
    "lcm_version": programs.lcm_version,
    "lcm_on_path": programs.lcm_on_path,
    "java": programs.java,
    "spy_plugin": programs.spy_plugin,
    "route": network.route,
    "loopback_flag": network.loopback_flag,
    "multicast": network.multicast,
    "receive_buffer": network.receive_buffer,
    "namespaces": network.namespaces,
    "fifo": timing.fifo,
    "memory_lock": timing.memory_lock,
    "preemption": timing.preemption,
    "throttling": timing.throttling,
    "governor": timing.governor,
    "clock_source": timing.clock_source,
    "idle_states": timing.idle_states,
    "isolated": timing.isolated,
}
STYLES = {OK: "green", WARNING: "yellow", PROBLEM: "bold red"}


def examine(machine: Machine) -> dict[str, Finding]:
    """Return a finding for every check, by its name."""
    return {name: check(machine) for name, check in CHECKS.items()}


def to_json(findings: dict[str, Finding]) -> dict[str, Any]:
    """Return all findings and how many of them are no good."""
    kinds = [finding.kind for finding in findings.values()]
    rows = [{"check": name, **vars(finding)} for name, finding in findings.items()]
    counts = {"problems": kinds.count(PROBLEM), "warnings": kinds.count(WARNING)}
    return {**counts, "findings": rows}


def print_findings(findings: dict[str, Finding], quiet: bool) -> None:
    """Print a line for each finding and below it the fix; when quiet, problems alone."""
    console = Console(highlight=False, soft_wrap=True)
    for finding in findings.values():
        if quiet and finding.kind != PROBLEM:
            continue
        console.print(Text(f"{finding.kind:8}", STYLES[finding.kind]), Text(finding.text))
        if finding.fix:
            console.print(Text(f"{'':8}   {finding.fix}"))
    if not quiet and any("sysctl -w" in finding.fix for finding in findings.values()):
        console.print(
            "what sysctl sets lasts until the next start; a file in /etc/sysctl.d keeps it"
        )
