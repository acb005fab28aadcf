"""What keeping time needs of this machine: permissions, kernel and clock."""

from __future__ import annotations

import os
import re

from leeway.doctor.machine import CAP_IPC_LOCK, CAP_SYS_NICE, OK, WARNING, Finding, Machine

PRIORITY = 80  # of the programs' real-time threads
ENOUGH_LOCKED = 512 << 20  # bytes, more than either program maps
PREEMPT_SWITCH = "sys/kernel/debug/sched/preempt"
DMA_LATENCY = "dev/cpu_dma_latency"
FAST_CLOCKS = {"tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter"}
SLOW_CLOCKS = {"hpet", "acpi_pm", "jiffies", "refined-jiffies", "xen"}
CLOCK = "sys/devices/system/clocksource/clocksource0"


def _raise_limit(what: str, value: str) -> str:
    """Return the command that raises a limit of this user."""
    line = f'"$(id -un) - {what} {value}"'
    return f"echo {line} | sudo tee -a /etc/security/limits.d/leeway.conf, then log in anew"


def fifo(machine: Machine) -> Finding:
    """SCHED_FIFO for the real-time threads: tried."""
    if machine.try_fifo(PRIORITY):
        return Finding(OK, f"real-time scheduling: SCHED_FIFO {PRIORITY} granted")
    text = "no real-time scheduling: ticks may be late"
    if machine.limit("Max realtime priority") >= PRIORITY or machine.capable(CAP_SYS_NICE):
        text += "; the limits allow it, this control group gives no real-time share"
        return Finding(WARNING, text, "sudo sysctl -w kernel.sched_rt_runtime_us=-1")
    if machine.user == 0:
        options = "--cap-add=SYS_NICE --ulimit rtprio=90"
        return Finding(WARNING, text, f"start the container with {options}")
    return Finding(WARNING, text, _raise_limit("rtprio", "90"))


def memory_lock(machine: Machine) -> Finding:
    """Locked memory: without it a page may be fetched from disk in a tick."""
    limit = machine.limit("Max locked memory")
    if machine.capable(CAP_IPC_LOCK) or limit == float("inf"):
        return Finding(OK, "memory locking: no limit")
    if limit >= ENOUGH_LOCKED:
        return Finding(OK, f"memory locking: up to {int(limit) >> 20} MiB")
    text = f"memory locking is limited to {int(limit) >> 10} kB"
    if machine.user == 0:
        options = "--cap-add=IPC_LOCK --ulimit memlock=-1"
        return Finding(WARNING, text, f"start the container with {options}")
    return Finding(WARNING, text, _raise_limit("memlock", "unlimited"))


def _config_mode(machine: Machine) -> tuple[str, str]:
    """Return the preemption that the kernel was built with, and the file that says so."""
    release = machine.read("proc/sys/kernel/osrelease") or ""
    for name in ("proc/config.gz", f"boot/config-{release}"):
        built = set((machine.read(name) or "").splitlines())
        for key, mode in (
            ("PREEMPT_RT", "rt"),
            ("PREEMPT_LAZY", "lazy"),
            ("PREEMPT", "full"),
            ("PREEMPT_VOLUNTARY", "voluntary"),
            ("PREEMPT_NONE", "none"),
        ):
            if f"CONFIG_{key}=y" in built:
                return mode, name
    return "", ""


def preemption_mode(machine: Machine) -> tuple[str, str]:
    """Return rt, full, lazy, voluntary, none or nothing, and the file that says so."""
    version = machine.read("proc/sys/kernel/version") or ""
    if machine.read("sys/kernel/realtime") == "1" or re.search("PREEMPT[_ ]RT", version):
        return "rt", "proc/sys/kernel/version"
    if chosen := re.search(r"\((\w+)\)", machine.read(PREEMPT_SWITCH) or ""):
        return chosen[1], PREEMPT_SWITCH
    asked = re.findall(r"(?:^|\s)preempt=(\w+)", machine.read("proc/cmdline") or "")
    if asked and "PREEMPT_DYNAMIC" in version:
        return asked[-1], "proc/cmdline"
    mode, source = _config_mode(machine)
    if not mode and re.search(r"\bPREEMPT\b", version):
        return "full", "proc/sys/kernel/version"
    return mode, source


def preemption(machine: Machine) -> Finding:
    """How soon the kernel leaves what it does for a real-time thread."""
    mode, source = preemption_mode(machine)
    dynamic = "PREEMPT_DYNAMIC" in (machine.read("proc/sys/kernel/version") or "")
    unread = "" if machine.read(PREEMPT_SWITCH) else f"; /{PREEMPT_SWITCH} cannot be read"
    if mode == "rt":
        return Finding(OK, "kernel preemption: PREEMPT_RT")
    if not mode:
        text = f"kernel preemption is unknown: /proc/config.gz, /boot/config-*{unread}"
        return Finding(WARNING, text, "uname -v; sudo cat /sys/kernel/debug/sched/preempt")
    text = f"kernel preemption: {mode} (from /{source}{unread if dynamic else ''})"
    # Lazy preemption makes only normal threads wait.
    if mode in ("full", "lazy"):
        return Finding(OK, text)
    text += ": system calls of others can delay a tick"
    return Finding(WARNING, text, _preemption_fix(machine, dynamic))


def _preemption_fix(machine: Machine, dynamic: bool) -> str:
    """Return how to get full preemption on this system."""
    always = "add preempt=full to the kernel's command line and restart"
    if dynamic and (machine.user != 0 or machine.read(PREEMPT_SWITCH)):
        return f"echo full | sudo tee /{PREEMPT_SWITCH}   (for good: {always})"
    if dynamic:
        return always
    system = machine.read("etc/os-release") or ""
    if re.search(r"^ID=ubuntu$", system, re.M):
        return "sudo pro enable realtime-kernel, then restart"
    if re.search(r"^ID=debian$", system, re.M):
        architecture = {"x86_64": "amd64", "aarch64": "arm64"}.get(os.uname().machine, "")
        return f"sudo apt-get install linux-image-rt-{architecture}, then restart"
    return "install a kernel with PREEMPT_RT by your system's own means"


def throttling(machine: Machine) -> Finding:
    """The share of each second that real-time threads may use."""
    runtime = machine.number("proc/sys/kernel/sched_rt_runtime_us")
    period = machine.number("proc/sys/kernel/sched_rt_period_us")
    if runtime is None or not period:
        text = "real-time throttling cannot be read from /proc/sys/kernel/sched_rt_runtime_us"
        return Finding(WARNING, text, "sudo sysctl kernel.sched_rt_runtime_us")
    if runtime < 0:
        return Finding(OK, "real-time throttling: off")
    text = f"real-time throttling: {runtime} of each {period} us"
    if runtime >= 0.9 * period:
        return Finding(OK, f"{text}; the programs use less")
    usual = int(0.95 * period)
    return Finding(WARNING, text, f"sudo sysctl -w kernel.sched_rt_runtime_us={usual}")


def governor(machine: Machine) -> Finding:
    """The choice of the processors' clock rate; machines that are virtual have none."""
    pattern = "sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor"
    found = sorted(str(p.relative_to(machine.root)) for p in machine.root.glob(pattern))
    names = [machine.read(name) or "unreadable" for name in found]
    if not names:
        return Finding(OK, "CPU governor: none here (a virtual machine, or a fixed rate)")
    others = sorted(set(names) - {"performance"})
    if not others:
        return Finding(OK, "CPU governor: performance")
    text = f"CPU governor: {', '.join(others)}: a CPU that was idle starts slowly"
    return Finding(WARNING, text, f"echo performance | sudo tee /{pattern.replace('[0-9]', '')}")


def clock_source(machine: Machine) -> Finding:
    """The kernel's clock: some cost a microsecond and more to read."""
    name = machine.read(f"{CLOCK}/current_clocksource")
    if not name:
        text = f"clock source cannot be read from /{CLOCK}/current_clocksource"
        return Finding(
            WARNING, text, f"cat /{CLOCK}/current_clocksource   (outside of a container)"
        )
    if name not in SLOW_CLOCKS:
        return Finding(OK, f"clock source: {name}")
    text = f"clock source: {name}: slow to read"
    available = (machine.read(f"{CLOCK}/available_clocksource") or "").split()
    for better in available:
        if better in FAST_CLOCKS:
            return Finding(WARNING, text, f"echo {better} | sudo tee /{CLOCK}/current_clocksource")
    return Finding(WARNING, text, "add tsc=reliable to the kernel's command line and restart")


def idle_states(machine: Machine) -> Finding:
    """Whether the programs may keep the processors from deep sleep."""
    device = machine.root / DMA_LATENCY
    if not device.exists():
        return Finding(OK, f"CPU sleep: no /{DMA_LATENCY} here, the machine decides alone")
    if machine.may_write(device):
        return Finding(OK, f"CPU sleep: /{DMA_LATENCY} is writable")
    rule = 'KERNEL=="cpu_dma_latency", MODE="0666"'
    text = f"/{DMA_LATENCY} is not writable: a CPU may sleep deeply between two ticks"
    return Finding(
        WARNING,
        text,
        f"echo '{rule}' | sudo tee /etc/udev/rules.d/60-leeway.rules && "
        "sudo udevadm control --reload && sudo udevadm trigger --name-match=cpu_dma_latency",
    )


def isolated(machine: Machine) -> Finding:
    """Processors set apart from normal scheduling; a note, not a judgement."""
    names = machine.read("sys/devices/system/cpu/isolated")
    said = f"{names}; --cpu binds a program to one" if names else "none"
    return Finding(OK, f"isolated CPUs: {said}")
