"""How a program fares: STATUS and PLANT_STATUS with names for numbers.

Values of states, faults and reasons are those of the generated `status_t`; only their grouping
stands here. Times are us, distances m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, cast

from leeway_lcm import leeway as _generated

wire = cast(Any, _generated)  # generated code carries no types: this is where they end

COUNTS = (
    *("ticks", "skipped", "stale_ticks", "unsent", "peer_session", "taken", "missed"),
    *("takeovers", "minor_faults", "major_faults", "stuck_since_ns", "obstacle_count"),
)
STATES = ("STARTING", "WAITING", "RUNNING", "STOPPING", "ENDING")
FAULTS = ("PEER_TIMEOUT", "OVERRUN", "BAD_INPUT", "LEASE", "UNSENT", "LOST_RECORDS")
REALTIME = ("FIFO", "LOCKED", "AWAKE", "PINNED")
REASONS = (
    *("SIZE", "TYPE", "NO_NUMBER", "RANGE", "DUPLICATE", "BACKWARDS", "FOREIGN"),
    *("OTHER_PLANT", "STALE", "GUARD", "IDLE", "FULL", "UNKNOWN"),
)


def _by_value(constants: Sequence[str]) -> dict[int, str]:
    """Return the names of some constants, in lower case, by their values."""
    return {getattr(wire.status_t, name): name.lower() for name in constants}


_STATES, _FAULTS, _REALTIME, _REASONS = map(_by_value, (STATES, FAULTS, REALTIME, REASONS))


def state_name(state: int) -> str:
    """Return the name of a state; of one that is not known, its number."""
    return _STATES.get(state, f"state {state}")


def _bit_names(bits: int, names: dict[int, str]) -> list[str]:
    """Return the names of the bits of a set, unknown ones by their value."""
    each = [1 << place for place in range(32) if bits >> place & 1]
    return [names.get(bit, f"bit {bit}") for bit in each]


def fault_names(faults: int) -> list[str]:
    """Return the names of a set of faults, in the order of the bits."""
    return _bit_names(faults, _FAULTS)


def realtime_names(realtime: int) -> list[str]:
    """Return the names of what the system granted, in the order of the bits."""
    return _bit_names(realtime, _REALTIME)


def refusals(counts: Sequence[int]) -> dict[str, int]:
    """Return the counts that are not 0, by the name of their reason."""
    named = {_REASONS.get(reason, f"reason {reason}"): n for reason, n in enumerate(counts)}
    return {name: int(n) for name, n in named.items() if n}


@dataclass(frozen=True)
class Percentiles:
    """Distribution over the last second, us."""

    p50: float
    p99: float
    p999: float
    max: float

    @classmethod
    def of(cls, values_ns: Sequence[int]) -> Percentiles:
        """Take them from a field of status_t."""
        return cls(*(value / 1000 for value in values_ns))


@dataclass(frozen=True)
class Status:
    """One status message in words; names and meaning as in lcmtypes/status_t.lcm."""

    session: int
    mono_ns: int  # of the message
    state: str
    faults: list[str]
    faults_ever: list[str]
    realtime: list[str]
    rate_hz: float  # nominal
    ticks: int
    skipped: int
    stale_ticks: int
    unsent: int
    peer_session: int
    taken: int
    missed: int
    takeovers: int
    refused: dict[str, int]
    wake_late_us: Percentiles
    exec_us: Percentiles
    age_us: Percentiles
    minor_faults: int
    major_faults: int
    allocations: int | None  # None: this build cannot count them
    clearance: float | None  # None: no obstacle
    deviation: float
    stuck_since_ns: int
    obstacle_count: int
    world_age_ms: float | None  # None: nothing heard about obstacles

    def to_json(self) -> dict[str, Any]:
        """Return all fields as plain values."""
        return asdict(self)


def status_of(message: Any) -> Status:
    """Put a decoded status_t into words."""
    return Status(
        session=message.h.session,
        mono_ns=message.h.mono_ns,
        state=state_name(message.state),
        faults=fault_names(message.faults),
        faults_ever=fault_names(message.faults_ever),
        realtime=realtime_names(message.realtime),
        rate_hz=1e9 / message.period_ns if message.period_ns > 0 else 0.0,
        refused=refusals(message.refused),
        wake_late_us=Percentiles.of(message.wake_late_ns),
        exec_us=Percentiles.of(message.exec_ns),
        age_us=Percentiles.of(message.age_ns),
        allocations=message.allocations if message.allocations >= 0 else None,
        clearance=message.clearance if math.isfinite(message.clearance) else None,
        deviation=message.deviation,
        world_age_ms=message.world_age_ns / 1e6 if message.world_age_ns >= 0 else None,
        **{name: getattr(message, name) for name in COUNTS},
    )
