"""The part of a log in which one controller moved one plant.

Units are SI; time of motion is plant ticks times the plant's period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leeway.logs.log import Commands, Floats, Ints, Log, LogError, Messages, MessagesT, States

HOLD, MOVING, STOPPING = range(3)
VELOCITY = 1


@dataclass(frozen=True)
class Motion:
    """Commands from the first that was accepted to the last that answers a new state."""

    commands: Commands  # n ticks of one controller session, in its order
    states: States  # m states of one plant session from the start of motion on, one a plant tick
    heard: States  # all states of that session, also those before the motion
    t: Floats  # (n,) s
    plant_t: Floats  # (m,) s
    plant_qdd: Floats  # (m, 6) rad/s^2
    period: float  # s, controller
    plant_period: float  # s
    losses: dict[str, int]
    commands_after: int  # commands behind the last new state: braking without a plant

    @property
    def controller(self) -> int:
        """Session of the controller."""
        return int(self.commands.session[0])

    @property
    def plant(self) -> int:
        """Session of the plant."""
        return int(self.states.session[0])

    def time_of(self, mono_ns: int) -> float:
        """Return the time of motion, s, of a moment of this host's clock."""
        at = self.commands.mono_ns
        inside = float(np.interp(mono_ns, at, self.t))
        outside = min(mono_ns - int(at[0]), 0) + max(mono_ns - int(at[-1]), 0)
        return inside + outside * 1e-9


def select_motion(log: Log) -> Motion:
    """Find the newest plant session that moved and the newest controller session that moved it.

    Raises
    ------
    LogError
        Nothing moved.
    """
    if not len(log.commands):
        raise LogError(f"{log.path}: no JOINT_COMMAND in it: record while leeway-controller runs")
    plant, controller = _sessions(log)
    all_states = _in_order(log.states.take(log.states.session == plant))
    sent = _in_order(log.commands.take(log.commands.session == controller))
    commands, resent = _of_motion(sent, all_states, controller)
    new = np.flatnonzero(np.diff(commands.state_seq) > 0)
    end = int(new[-1]) + 2 if len(new) else 1
    after = len(commands) - end
    commands = commands.take(np.arange(end))
    period_ns = int(all_states.period_ns[0])
    plant_period = period_ns / 1e9
    states = all_states.take(_moving_part(all_states, int(commands.state_tick[0])))
    ratio = max(1, int(np.median(np.diff(commands.state_tick)))) if end > 1 else 1
    losses = _losses(commands, all_states, ratio) | {"commands_sent_again": resent}
    return Motion(
        commands=commands,
        states=states,
        heard=all_states,
        t=commands.state_tick * period_ns / 1e9,
        plant_t=states.tick * period_ns / 1e9,
        plant_qdd=_acceleration(states, plant_period),
        period=ratio * plant_period,
        plant_period=plant_period,
        losses=losses,
        commands_after=after,
    )


def sessions_of(messages: Messages) -> list[int]:
    """Return the sessions in a log, oldest first."""
    found, first = np.unique(messages.session, return_index=True)
    return [int(s) for s in found[np.argsort(first)]]


def _sessions(log: Log) -> tuple[int, int]:
    """Return the newest plant session that moved and the newest controller that moved it."""
    meant = np.unique(log.commands.plant_session)
    known = log.states.take(np.isin(log.states.session, meant))
    for plant in reversed(sessions_of(known)):
        states = log.states.take((log.states.session == plant) & (log.states.plant_mode != HOLD))
        obeyed = log.commands.take(
            (log.commands.plant_session == plant)
            & (log.commands.mode == VELOCITY)
            & np.isin(log.commands.session, states.command_session)
        )
        if len(states) and len(obeyed) and states.period_ns.min() > 0:
            return plant, sessions_of(obeyed)[-1]
    raise LogError(
        f"{log.path}: the arm never moved: no plant in it obeyed a command. A "
        "controller waits for JOINT_STATE and for one OBSTACLES message"
    )


def _in_order(messages: MessagesT) -> MessagesT:
    """Return the messages of one session by seq, each once."""
    return messages.take(np.unique(messages.seq, return_index=True)[1])


def _of_motion(sent: Commands, states: States, controller: int) -> tuple[Commands, int]:
    """Return the commands from the first accepted one on, one a tick; count those sent again."""
    accepted = states.command_seq[states.command_session == controller]
    first = int(accepted.min())
    plant = sent.plant_session == states.session[0]
    commands = sent.take(plant & (sent.mode == VELOCITY) & (sent.seq >= first))
    if not len(commands):  # the log begins after the last command: only possible in odd cuts
        commands = sent.take(plant & (sent.mode == VELOCITY))
    once = commands.take(np.unique(commands.tick, return_index=True)[1])
    return once, len(commands) - len(once)


def _moving_part(states: States, first_tick: int) -> NDArray[np.bool_]:
    """Return which states to show: from the one that the motion starts from, each tick once."""
    _, first = np.unique(states.tick[::-1], return_index=True)
    newest = np.zeros(len(states), dtype=np.bool_)
    newest[len(states) - 1 - first] = True
    shown = newest & (states.tick >= min(first_tick, int(states.tick[-1])))
    return shown


def _acceleration(states: States, period: float) -> Floats:
    """Return the change of qd over each plant period, (m, 6); its mean over a gap, first 0."""
    out = np.zeros_like(states.qd)
    steps = np.maximum(np.diff(states.tick), 1)[:, None]
    out[1:] = np.diff(states.qd, axis=0) / (steps * period)
    return out


def _losses(commands: Commands, states: States, ratio: int) -> dict[str, int]:
    """Count what is missing, by the messages' own numbers."""
    used = np.diff(commands.state_seq)
    obeyed = states.command_seq[states.command_session == commands.session[0]]
    return {
        "commands_not_in_log": _gaps(commands.seq),
        "states_not_in_log": _gaps(states.seq),
        "states_not_used": int(np.maximum(used - ratio, 0).sum()),
        "states_used_again": int((used == 0).sum()),
        "commands_not_obeyed": _gaps(obeyed),
    }


def _gaps(numbers: Ints) -> int:
    return int(np.maximum(np.diff(numbers) - 1, 0).sum())
