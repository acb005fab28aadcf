"""How the programs of a run fared, from their STATUS and PLANT_STATUS.

Times are us, and s of motion.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import Any

import numpy as np

from leeway.logs.log import Floats, Ints, Log, Statuses
from leeway.logs.motion import Motion
from leeway.status import Percentiles, Status, status_of

TIMES = {"wake_late_us": "wake_late_ns", "exec_us": "exec_ns", "age_us": "age_ns"}
_P99 = 1  # index of a percentile in a message


@dataclass(frozen=True)
class Program:
    """One program of a run: what it said last, and its percentiles over the run."""

    name: str  # controller or simulator
    last: Status
    worst: dict[str, Percentiles]  # by TIMES: the largest of each percentile in any message
    t: Floats  # (k,) s of motion, when it spoke
    p99_us: dict[str, Floats]  # by TIMES, (k,) of the second before; NaN = nothing to measure

    def to_json(self) -> dict[str, Any]:
        """Return all numbers as plain values, without the series."""
        worst = {f"worst_{name}": vars(values) for name, values in self.worst.items()}
        last = {k: v for k, v in self.last.to_json().items() if k not in TIMES}
        return {"program": f"leeway-{self.name}", **last, **worst}


def list_programs(log: Log, motion: Motion) -> list[Program]:
    """Return the programs of the motion that spoke, the controller first."""
    found = statuses_of(log, motion)
    return [_program(name, statuses, motion) for name, statuses in found.items() if len(statuses)]


def statuses_of(log: Log, motion: Motion) -> dict[str, Statuses]:
    """Return the messages of the sessions of the motion, by program, each once and in order."""
    return {
        "controller": _of_session(log.statuses, motion.controller),
        "simulator": _of_session(log.plant_statuses, motion.plant),
    }


def _of_session(statuses: Statuses, session: int) -> Statuses:
    own = statuses.take(statuses.session == session)
    return own.take(np.unique(own.seq, return_index=True)[1])


def _program(name: str, statuses: Statuses, motion: Motion) -> Program:
    times = {us: getattr(statuses, ns) for us, ns in TIMES.items()}
    return Program(
        name=name,
        last=status_of(_message(statuses, len(statuses) - 1)),
        worst={us: Percentiles.of(values.max(axis=0).tolist()) for us, values in times.items()},
        t=motion.times_of(statuses.mono_ns),
        p99_us={us: _p99(values) for us, values in times.items()},
    )


def _p99(values: Ints) -> Floats:
    us: Floats = values[:, _P99] / 1e3
    us[us <= 0] = np.nan
    return us


def _message(statuses: Statuses, row: int) -> SimpleNamespace:
    """Return one message as a decoded status_t has it."""
    values = {f.name: getattr(statuses, f.name)[row].tolist() for f in fields(statuses)}
    return SimpleNamespace(
        h=SimpleNamespace(session=values["session"], mono_ns=values["mono_ns"]), **values
    )
