"""Commands of `leeway` that look at the machine and the running programs."""

import json
import os
import sys
from typing import Annotated

import typer

from leeway.options import EXIT_FAILED, EXIT_USAGE, Common, command, fail


def register(app: typer.Typer) -> None:
    """Add the commands of this file."""
    command(app, "doctor", "leeway doctor")(doctor)
    command(app, "status", "leeway status --watch")(status)
    command(app, "spy", "leeway spy")(spy)


def _group(url: str | None) -> str:
    """Return the multicast group of the bus."""
    try:
        from leeway import bus
    except ImportError:
        # The doctor has a finding for an LCM that does not load.
        return "239.255.76.67"
    try:
        return bus.address(bus.resolve_url(url))[0]
    except bus.BusError as error:
        fail(str(error), EXIT_USAGE)


def doctor(*, common: Common) -> None:
    """Say what this machine lacks, and the command that mends it; warnings are no failure."""
    from leeway.doctor import Machine, examine, print_findings, to_json

    findings = examine(Machine(group=_group(common.url)))
    counts = to_json(findings)
    if common.as_json:
        print(json.dumps(counts, indent=2))
    else:
        print_findings(findings, common.quiet)
    if counts["problems"]:
        raise typer.Exit(EXIT_FAILED)


def status(
    watching: Annotated[
        bool, typer.Option("--watch", "-w", help="Refresh in place until Ctrl-C.")
    ] = False,
    *,
    common: Common,
) -> None:
    """Show how controller and simulator fare: state, faults, timing, refusals."""
    from rich.console import Console

    from leeway import bus, watch

    if watching and (common.silent or not sys.stdout.isatty()):
        fail("--watch needs a terminal, and neither --json nor --quiet", EXIT_USAGE)
    try:
        ear = watch.Ear(bus.resolve_url(common.url), common.name)
    except bus.BusError as error:
        fail(str(error))
    if watching:
        watch.watch(ear)
    senders = ear.look()
    if not senders:
        fail(watch.silence(ear))
    if common.as_json:
        print(json.dumps({"programs": [sender.to_json() for sender in senders]}, indent=2))
    elif not common.quiet:
        Console().print(watch.table(senders))


def spy(*, common: Common) -> None:
    """Open lcm-spy: every channel decoded; right click on WORLD puts obstacles on the bus."""
    from leeway import bus, processes
    from leeway.spy import SpyMissing, prepare

    if common.as_json:
        fail("lcm-spy is a window: there is no --json", EXIT_USAGE)
    try:
        command, environment = prepare(common.url, common.name)
    except (SpyMissing, bus.BusError, processes.ProgramMissing) as error:
        fail(str(error))
    if common.quiet:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    else:
        print("leeway: lcm-spy's own NoClassDefFoundError lines are harmless", file=sys.stderr)
    sys.stdout.flush()
    os.execve(command[0], command, environment)
