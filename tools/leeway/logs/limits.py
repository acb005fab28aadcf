"""How much of each limit a run used.

Units are rad, rad/s, rad/s^2; shares are 1 at the limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from leeway.logs.log import Commands, Floats, States
from leeway.logs.motion import MOVING, Motion

TOLERANCE = 1e-9  # relative


@dataclass(frozen=True)
class LimitUse:
    """One limit of the scene and how near the run came to it."""

    key: str  # key of the scene
    title: str
    unit: str
    limit: Floats  # (6,), infinite = off; for a range its half width
    largest: Floats  # (6,) largest size that occurred; for a range the distance from its middle
    joint: int  # 1..6, the one that came nearest to its limit; 0 = off
    t: float  # s, when
    share: float  # largest / limit of that joint; NaN = off
    series_t: Floats  # (n,) s
    series: Floats  # (n,) largest share over the joints

    @property
    def on(self) -> bool:
        """Whether any joint has this limit."""
        return bool(np.isfinite(self.limit).any())

    @property
    def exceeded(self) -> bool:
        """Whether a joint went over its limit by more than rounding."""
        return self.on and self.share > 1 + TOLERANCE

    def to_json(self) -> dict[str, Any]:
        """Return the numbers, without the series."""
        return {
            "key": self.key,
            "unit": self.unit,
            "on": self.on,
            "limit": [float(v) for v in self.limit],
            "largest": [float(v) for v in self.largest],
            "share": self.share,
            "joint": self.joint,
            "t": self.t,
            "exceeded": self.exceeded,
        }


def limit_uses(scene: dict[str, Any], motion: Motion) -> list[LimitUse]:
    """Return the use of every limit: the guard's by the commands, the plant's by its states.

    Parameters
    ----------
    scene
        Scene as a dictionary; limits that are off are infinite.
    """
    guard, plant = scene["limits"], scene["plant"]
    t, plant_t = motion.t, motion.plant_t
    low, high = np.array(guard["position_min"]), np.array(guard["position_max"])
    from_middle = np.abs(motion.states.q - (low + high) / 2)
    step = command_acceleration(motion.commands, motion.heard, motion.period)
    return [
        _use(("limits.position", "joint range", "rad"), (high - low) / 2, plant_t, from_middle),
        _use(("limits.velocity", "speed", "rad/s"), guard["velocity"], t, motion.commands.qd),
        _use(("limits.acceleration", "acceleration", "rad/s^2"), guard["acceleration"], t, step),
        _use(
            ("plant.velocity", "plant speed", "rad/s"), plant["velocity"], plant_t, motion.states.qd
        ),
        _use(
            ("plant.acceleration", "plant acceleration", "rad/s^2"),
            plant["acceleration"],
            plant_t,
            motion.plant_qdd,
        ),
    ]


def command_acceleration(commands: Commands, states: States, period: float) -> Floats:
    """Return the step of the command in each tick over the period, (n, 6) rad/s^2.

    The step counts from the command before; where the plant did not follow commands, from the
    plant's own velocity, as the controller does. NaN where the log lacks the tick before.
    """
    before = np.vstack([np.full((1, 6), np.nan), commands.qd[:-1]])
    before[1:][np.diff(commands.tick) != 1] = np.nan
    at = np.clip(np.searchsorted(states.seq, commands.state_seq), 0, len(states) - 1)
    own = (states.seq[at] == commands.state_seq) & (states.plant_mode[at] != MOVING)
    before[own] = states.qd[at][own]
    step: Floats = (commands.qd - before) / period
    return step


def _use(names: tuple[str, str, str], limit: Any, t: Floats, values: Floats) -> LimitUse:
    bound = np.asarray(limit, dtype=np.float64)
    sizes = np.nan_to_num(np.abs(values), nan=0.0, posinf=np.inf)
    shares = np.divide(sizes, bound, out=np.zeros_like(sizes), where=np.isfinite(bound))
    on = bool(np.isfinite(bound).any())
    row, joint = np.unravel_index(np.argmax(shares), shares.shape)
    return LimitUse(
        *names,
        limit=bound,
        largest=sizes.max(axis=0),
        joint=int(joint) + 1 if on else 0,
        t=float(t[row]) if on else math.nan,
        share=float(shares[row, joint]) if on else math.nan,
        series_t=t,
        series=shares.max(axis=1),
    )
