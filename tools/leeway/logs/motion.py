"""The part of a log in which one controller moved one plant.

Units are SI; time of motion is plant ticks times the plant's period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leeway.logs.log import Commands, Floats, Ints, Log, LogError, Messages, MessagesT, States

HOLD, MOVING, STOPPING, ENDED = range(4)
VELOCITY = 1


@dataclass(frozen=True)
class Motion:
    """Commands from the first that was accepted to the last that answers a new state.

    In a log of a controller that was never obeyed they begin with its first command of motion.
    """

    commands: Commands  # n ticks of one controller session, in its order
    states: States  # m states of one plant session from the start of motion on, one a plant tick
    heard: States  # all states of that session, also those before the motion
    t: Floats  # (n,) s
    plant_t: Floats  # (m,) s
    plant_qdd: Floats  # (m, 6) rad/s^2
    period: float  # s, controller
    plant_period: float  # s
    losses: dict[str, int]
    before: Commands  # of the same session, in front of `commands`, idle ones too
    after: Commands  # of the same session, behind the last new state: braking without a plant
    post_mortem: bool  # the log is one that the controller wrote after a fault

    @property
    def controller(self) -> int:
        """Session of the controller."""
        return int(self.commands.session[0])

    @property
    def plant(self) -> int:
        """Session of the plant."""
        return int(self.states.session[0])

    @property
    def obeyed(self) -> bool:
        """Whether the plant took any command of this controller."""
        return self.controller in self.heard.command_session

    @property
    def ended(self) -> bool:
        """Whether the plant took its leave."""
        return ENDED in self.heard.plant_mode

    def time_of(self, mono_ns: int) -> float:
        """Return the time of motion, s, of a moment of this host's clock."""
        return float(self.times_of(np.array([mono_ns]))[0])

    def times_of(self, mono_ns: Ints) -> Floats:
        """Return the times of motion, (k,) s, of moments of this host's clock, (k,) ns."""
        at = self.commands.mono_ns
        inside = np.interp(mono_ns, at, self.t)
        outside = np.minimum(mono_ns - at[0], 0) + np.maximum(mono_ns - at[-1], 0)
        times: Floats = inside + outside * 1e-9
        return times


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
    commands, answers = _of_motion(sent, all_states, controller)
    new = np.flatnonzero(np.diff(commands.state_seq) > 0)
    end = int(new[-1]) + 2 if len(new) else 1
    before = sent.take(sent.tick < commands.tick[0])
    after = commands.take(np.arange(end, len(commands)))
    commands = commands.take(np.arange(end))
    period_ns = int(all_states.period_ns[0])
    plant_period = period_ns / 1e9
    states = all_states.take(_moving_part(all_states, int(commands.state_tick[0])))
    ratio = max(1, int(np.median(np.diff(commands.state_tick)))) if end > 1 else 1
    post_mortem = _is_post_mortem(log)
    answers = answers.take(answers.seq <= commands.seq[-1])
    losses = _losses(commands, answers, all_states, ratio, post_mortem)
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
        before=before,
        after=after,
        post_mortem=post_mortem,
    )


def sessions_of(messages: Messages) -> list[int]:
    """Return the sessions in a log, oldest first."""
    found, first = np.unique(messages.session, return_index=True)
    return [int(s) for s in found[np.argsort(first)]]


def _sessions(log: Log) -> tuple[int, int]:
    """Return the newest plant session that moved and the newest controller that moved it.

    When no controller in the log moved a plant: the newest that asked a moving plant to move.
    """
    known = log.states.take(np.isin(log.states.session, np.unique(log.commands.plant_session)))
    for must_obey in (True, False):
        for plant in reversed(sessions_of(known)):
            moved = (log.states.session == plant) & (log.states.plant_mode != HOLD)
            states = log.states.take(moved)
            meant = (log.commands.plant_session == plant) & (log.commands.mode == VELOCITY)
            if must_obey:
                meant &= np.isin(log.commands.session, states.command_session)
            if meant.any() and len(states) and states.period_ns.min() > 0:
                return plant, sessions_of(log.commands.take(meant))[-1]
    if len(log.states) and MOVING in log.states.plant_mode and VELOCITY not in log.commands.mode:
        raise LogError(
            f"{log.path}: no controller in it asked for motion: all {len(log.commands)} commands "
            "are idle, and the arm was moved by another"
        )
    raise LogError(
        f"{log.path}: the arm never moved: no plant in it obeyed a command. A "
        "controller waits for JOINT_STATE and for one OBSTACLES message"
    )


def _in_order(messages: MessagesT) -> MessagesT:
    """Return the messages of one session by seq, each once."""
    return messages.take(np.unique(messages.seq, return_index=True)[1])


def _of_motion(sent: Commands, states: States, controller: int) -> tuple[Commands, Commands]:
    """Return the commands from the first accepted one on: the last of each tick, and all.

    In lockstep a tick has several when its answer got lost, or when obstacles came late.
    """
    accepted = states.command_seq[states.command_session == controller]
    first = int(accepted.min(initial=np.iinfo(np.int64).max))
    plant = sent.plant_session == states.session[0]
    commands = sent.take(plant & (sent.mode == VELOCITY) & (sent.seq >= first))
    if not len(commands):  # never obeyed, or the log begins after the last one that was
        commands = sent.take(plant & (sent.mode == VELOCITY))
    _, from_end = np.unique(commands.tick[::-1], return_index=True)
    return commands.take(len(commands) - 1 - from_end), commands


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


def _is_post_mortem(log: Log) -> bool:
    """Return whether the controller wrote this log after a fault.

    Such a log has one SCENE, of its only controller, no STATUS, and of the plant the states that
    the controller used and no other. A recorder hears more.
    """
    only = [scene.session for scene in log.scenes] == sessions_of(log.commands)
    silent = len(log.statuses) + len(log.plant_statuses) == 0
    return only and silent and bool(np.isin(log.states.seq, log.commands.state_seq).all())


def _losses(
    commands: Commands, answers: Commands, states: States, ratio: int, post_mortem: bool
) -> dict[str, int]:
    """Count what is missing, by the messages' own numbers.

    A post-mortem log lacks the states that were not used, which is no loss; what they echoed is
    not known. Of several answers of a tick, `answers`, the plant obeys one.
    """
    again = len(answers) - len(commands)
    own = states.take(states.command_session == commands.session[0])
    passed = np.maximum(np.diff(own.command_seq) - 1, 0)
    if post_mortem:
        passed = passed[np.diff(own.seq) == 1]
    return {
        "commands_not_in_log": _gaps(answers.seq),
        "states_not_in_log": 0 if post_mortem else _gaps(states.seq),
        "states_not_used": int(np.maximum(np.diff(answers.state_seq) - ratio, 0).sum()),
        "states_used_again": int((np.diff(commands.state_seq) == 0).sum()),
        "commands_not_obeyed": max(0, int(passed.sum()) - again),
        "commands_sent_again": again,
    }


def _gaps(numbers: Ints) -> int:
    return int(np.maximum(np.diff(numbers) - 1, 0).sum())
