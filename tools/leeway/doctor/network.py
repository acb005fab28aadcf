"""What the bus needs of this machine's network."""

from __future__ import annotations

import re

from leeway.doctor.machine import OK, PROBLEM, WARNING, Finding, Machine

RECEIVE_BUFFER = 2 << 20  # bytes, what LCM's documentation asks for
USUAL_DEFAULT = 212992  # bytes, rmem_default of an untouched kernel
IFF_MULTICAST = 0x1000
LOCAL_ROUTE = "sudo ip link set lo up && sudo ip route add 224.0.0.0/4 dev lo"


def _device(machine: Machine) -> str | None:
    """Return the interface that the bus goes through, None without a route."""
    found = machine.run(["ip", "route", "get", machine.group])
    device = re.search(r"\bdev (\S+)", found.output)
    return device[1] if found.status == 0 and device else None


def route(machine: Machine) -> Finding:
    """A route for the bus's group: without one LCM cannot open a bus."""
    if machine.run(["ip", "-V"]).status != 0:
        install = "sudo apt-get install --no-install-recommends iproute2"
        return Finding(WARNING, "the multicast route cannot be read: no command ip", install)
    device = _device(machine)
    if device is None:
        text = f"no multicast route to {machine.group}: LCM cannot open a bus"
        return Finding(PROBLEM, text, LOCAL_ROUTE)
    return Finding(OK, f"multicast route: dev {device}")


def loopback_flag(machine: Machine) -> Finding:
    """The MULTICAST flag of lo, where the bus goes through lo."""
    flags = machine.number("sys/class/net/lo/flags")
    if flags is None:
        text = "flags of lo cannot be read from /sys/class/net/lo/flags"
        return Finding(WARNING, text, "ip link show lo   (is MULTICAST among the flags?)")
    if not flags & IFF_MULTICAST and _device(machine) == "lo":
        text = "the bus goes through lo, whose MULTICAST flag is off: some programs refuse it"
        return Finding(WARNING, text, "sudo ip link set lo multicast on")
    return Finding(OK, "multicast flag of lo: " + ("on" if flags & IFF_MULTICAST else "not needed"))


def multicast(machine: Machine) -> Finding:
    """A datagram to the bus's group comes back: measured."""
    try:
        seconds = machine.multicast_round(machine.group)
    except TimeoutError:
        text = f"multicast does not come back: nothing arrived from {machine.group} within 1 s"
        allow = f"sudo iptables -I INPUT -d {machine.group} -j ACCEPT"
        return Finding(PROBLEM, text, f"{LOCAL_ROUTE}; if a firewall drops it: {allow}")
    except OSError as error:
        return Finding(PROBLEM, f"multicast cannot be sent: {error.strerror}", LOCAL_ROUTE)
    return Finding(OK, f"multicast comes back: {seconds * 1e6:.0f} us, measured once")


def receive_buffer(machine: Machine) -> Finding:
    """Room for a burst of messages in the kernel."""
    largest = machine.number("proc/sys/net/core/rmem_max")
    usual = machine.number("proc/sys/net/core/rmem_default")
    if largest is None:
        text = "receive buffer cannot be read from /proc/sys/net/core (a private network?)"
        return Finding(WARNING, text, "sysctl net.core.rmem_max   (outside of a container)")
    if largest < RECEIVE_BUFFER:
        text = f"receive buffer of at most {largest} bytes: bursts may lose messages"
        return Finding(WARNING, text, f"sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}")
    if usual is not None and usual < USUAL_DEFAULT:
        text = f"receive buffer of {usual} bytes for programs that ask for none, as lcm-logger"
        return Finding(WARNING, text, f"sudo sysctl -w net.core.rmem_default={USUAL_DEFAULT}")
    said = f", {usual} for programs that ask for none" if usual is not None else ""
    return Finding(OK, f"receive buffer: up to {largest} bytes{said}")


def namespaces(machine: Machine) -> Finding:
    """A network of its own for tests and demo."""
    flags = "-n" if machine.user == 0 else "-rn"
    found = machine.run(["unshare", flags, "true"])
    if found.status == 0:
        return Finding(OK, "private network namespaces")
    text = "no private networks: demo and tests share this machine's"
    for name, closed, opened in (
        ("kernel/apparmor_restrict_unprivileged_userns", 1, 0),
        ("kernel/unprivileged_userns_clone", 0, 1),
        ("user/max_user_namespaces", 0, 4096),
        ("user/max_net_namespaces", 0, 4096),
    ):
        if machine.number(f"proc/sys/{name}") == closed:
            return Finding(WARNING, text, f"sudo sysctl -w {name.replace('/', '.')}={opened}")
    if machine.user == 0:
        return Finding(WARNING, text, "start the container with --cap-add=SYS_ADMIN")
    return Finding(WARNING, text, "sudo ./dev test   (as root they have one)")
