"""A run in numbers, from its log. No printing, no pictures.

Units are SI: m, rad, s; timing is in us where a name says so. Positions are in the base frame of
the arm. Ticks are aligned by the messages' own fields (session, seq, tick, mono_ns), never by the
logger's time stamps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leeway import _native
from leeway.logs.events import Event, list_events
from leeway.logs.limits import LimitUse, limit_uses
from leeway.logs.log import Commands, Floats, Ints, Log, LogError, SceneMessage
from leeway.logs.motion import select_motion
from leeway.logs.programs import Program, list_programs
from leeway.logs.world import WorldLine, follow

FLAGS = {
    "position": 1,
    "velocity": 2,
    "acceleration": 4,
    "stopped": 8,
    "stale": 16,
    "not_finite": 32,
    "waiting": 64,
    "foreign": 128,
    "warming_up": 256,
    "clearance": 512,
    "contact": 1024,
}
MOVING_POINTS = slice(1, 6)  # point 1 lies on axis 1 and never moves
PERCENTILES = {"p50": 50.0, "p99": 99.0, "p99_9": 99.9, "max": 100.0}


@dataclass(frozen=True)
class Nearest:
    """Smallest clearance of a run, as the controller's ticks found it."""

    distance: float  # m, between the surfaces; NaN when there was no obstacle
    link: int  # 1..6, with control points their number; 0 = none
    obstacle: int  # id, 0 = none
    t: float  # s


@dataclass(frozen=True)
class Analysis:
    """What a log says about its run. Arrays have n rows, one a controller tick of motion."""

    path: Path
    label: str  # name of the scene file
    robot: str
    mode: str  # realtime or lockstep
    build: str
    scene: dict[str, Any]
    scene_yaml: str
    rho: float  # m, reach of the repulsion
    gamma: int
    attraction: str
    period: float  # s, of the controller
    truncated_bytes: int
    counts: dict[str, int]
    undecodable: dict[str, int]

    t: Floats  # (n,) s, time of motion
    q: Floats  # (n, 6)
    qd: Floats  # (n, 6) commanded
    qd_law: Floats  # (n, 6) wanted by the law
    points: Floats  # (n, 6, 3) origins of the DH frames 1..6
    goal: Floats  # (n, 3) goal in force
    deviation: Floats  # (n,)
    distances: Floats  # (n, 6) to the nearest surface, NaN = no obstacle
    nearest_obstacle: Ints  # (n, 6) its id, 0 = none
    clearance: Floats  # (n,) of the whole arm as the commands tell it, NaN = no obstacle
    flags: Ints  # (n,) bits as in FLAGS
    world: WorldLine
    wake_us: Floats  # (n,) lateness of the wake-up
    exec_us: Floats  # (n - 1,) wake-up until the command was handed to the bus
    age_us: Floats  # (n,) age of the joint state used
    plant_t: Floats  # (m,) s
    plant_q: Floats  # (m, 6)
    plant_qd: Floats  # (m, 6)
    plant_qdd: Floats  # (m, 6) change of plant_qd in one plant period

    limits: list[LimitUse]
    smallest: Nearest
    distance_check: float  # m, largest difference between distances here and in the commands
    late_ticks: int  # periods that the controller skipped during the motion
    losses: dict[str, int]
    post_mortem: bool  # written by the controller after a fault: no recorder's log
    programs: list[Program]  # of the motion; empty when the log has no STATUS of them
    events: list[Event] = field(default_factory=list)

    @property
    def tip(self) -> Floats:
        """Position of the tip, (n, 3) m."""
        return self.points[:, 5]

    @property
    def ticks(self) -> int:
        """Controller ticks of motion."""
        return len(self.t)

    @property
    def duration(self) -> float:
        """Time of motion that was recorded, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def final_deviation(self) -> float:
        """Distance of the tip to the goal at the last tick, m."""
        return float(self.deviation[-1])

    @property
    def smallest_distance(self) -> float:
        """Smallest clearance of the arm, or of its control points, m; NaN without obstacles."""
        return self.smallest.distance

    @property
    def tip_path_length(self) -> float:
        """Length of the way of the tip, m."""
        return float(np.nansum(np.linalg.norm(np.diff(self.tip, axis=0), axis=1)))

    @property
    def limits_kept(self) -> bool:
        """Whether no limit that is on was exceeded."""
        return not any(use.exceeded for use in self.limits)

    @property
    def flag_shares(self) -> dict[str, float]:
        """Share of ticks (0..1) in which each flag was set."""
        return {name: float(np.mean((self.flags & bit) != 0)) for name, bit in FLAGS.items()}

    @property
    def why_no_programs(self) -> str:
        """Why `programs` is empty."""
        if self.mode == "lockstep":
            return "in lockstep the programs tell no STATUS"
        return f"no STATUS of them in this {'post-mortem ' if self.post_mortem else ''}log"

    @property
    def timing(self) -> dict[str, dict[str, float]]:
        """Percentiles in us of wake lateness, execution and state age; empty in lockstep."""
        if self.mode == "lockstep":
            return {}
        columns = {
            "wake_late_us": self.wake_us,
            "exec_us": self.exec_us,
            "state_age_us": self.age_us,
        }
        return {name: percentiles(values) for name, values in columns.items() if len(values)}

    @np.errstate(over="ignore", invalid="ignore")
    def to_json(self) -> dict[str, Any]:
        """Return every number as plain values: no arrays, null for what is off or missing."""
        numbers = {
            "path": str(self.path),
            "label": self.label,
            "robot": self.robot,
            "mode": self.mode,
            "build": self.build,
            "rho": self.rho,
            "gamma": self.gamma,
            "attraction": self.attraction,
            "period": self.period,
            "duration": self.duration,
            "ticks": self.ticks,
            "late_ticks": self.late_ticks,
            "final_deviation": self.final_deviation,
            "smallest_distance": vars(self.smallest),
            "tip_path_length": self.tip_path_length,
            "max_speed": _largest(self.qd),
            "max_plant_speed": _largest(self.plant_qd),
            "max_plant_acceleration": _largest(self.plant_qdd),
            "limits_kept": self.limits_kept,
            "limits": [use.to_json() for use in self.limits],
            "flag_shares": self.flag_shares,
            "timing": self.timing,
            "losses": self.losses,
            "post_mortem": self.post_mortem,
            "programs": [program.to_json() for program in self.programs],
            "truncated_bytes": self.truncated_bytes,
            "counts": self.counts,
            "undecodable": self.undecodable,
            "distance_check": self.distance_check,
            "events": [vars(event) for event in self.events],
            "scene": self.scene,
        }
        plain: dict[str, Any] = _plain(numbers)
        return plain


@np.errstate(over="ignore", invalid="ignore")  # damaged numbers come out as infinite or NaN
def analyse(log: Log) -> Analysis:
    """Turn a log into numbers.

    Takes the newest plant session that moved and the newest controller session that moved it;
    other sessions become events.

    Raises
    ------
    LogError
        The log holds no motion, or no SCENE that this version can read.
    """
    motion = select_motion(log)
    scene_message = _scene_message(log, motion.commands)
    scene = _read_scene(log, scene_message)
    commands, states = motion.commands, motion.states
    points = _control_points(scene["robot"], commands.q)
    if not np.isfinite(points).any():
        raise LogError(f"{log.path}: no joint position in its commands is a number")
    goal = _goal_in_force(commands, scene["request"]["goal"])
    around = follow(log, commands, points)
    line, distances, obstacle = around.line, around.distance, around.obstacle
    uses = limit_uses(scene, motion)
    lockstep = scene_message.mode == "lockstep"
    stem = Path(scene_message.file).stem
    events = list_events(log, motion, line, goal, scene["duration_s"])
    return Analysis(
        path=log.path,
        label=stem or log.path.stem,
        robot=scene["robot"],
        mode=scene_message.mode,
        build=scene_message.build,
        scene=scene,
        scene_yaml=scene_message.yaml,
        rho=float(scene["law"]["rho_rep"]),
        gamma=int(scene["law"]["gamma"]),
        attraction=str(scene["law"]["attraction"]),
        period=motion.period,
        truncated_bytes=log.truncated,
        counts=log.counts,
        undecodable=log.undecodable,
        t=motion.t,
        q=commands.q,
        qd=commands.qd,
        qd_law=commands.qd_law,
        points=points,
        goal=goal,
        deviation=np.linalg.norm(goal - points[:, 5], axis=1),
        distances=distances,
        nearest_obstacle=obstacle,
        clearance=np.where(np.isfinite(commands.clearance), commands.clearance, np.nan),
        flags=commands.flags,
        world=line,
        wake_us=commands.wake_late_ns / 1e3,
        exec_us=commands.previous_exec_ns[1:] / 1e3,
        age_us=commands.state_age_ns / 1e3,
        plant_t=motion.plant_t,
        plant_q=states.q,
        plant_qd=states.qd,
        plant_qdd=motion.plant_qdd,
        limits=uses,
        smallest=_smallest(motion.t, commands),
        distance_check=_compare(distances, commands.clearance, scene["law"]["control_points"]),
        late_ticks=0 if lockstep else int(commands.skipped[-1] - commands.skipped[0]),
        losses=motion.losses | {"worlds_unknown": line.unknown_ticks},
        post_mortem=motion.post_mortem,
        programs=list_programs(log, motion),
        events=events,
    )


def percentiles(values: Floats) -> dict[str, float]:
    """Return p50, p99, p99_9 and max; each is a value that occurred."""
    ordered = np.sort(values)
    ranks = [math.ceil(p / 100 * len(ordered) - 1e-9) for p in PERCENTILES.values()]
    return {name: float(ordered[rank - 1]) for name, rank in zip(PERCENTILES, ranks, strict=True)}


def _scene_message(log: Log, commands: Commands) -> SceneMessage:
    """Return what the controller of the motion said that it runs, else what any program said."""
    own = [m for m in log.scenes if m.session == commands.session[0]]
    if not (own or log.scenes):
        raise LogError(
            f"{log.path}: no SCENE in it, so robot and limits are unknown: keep lcm-logger running "
            "for a second or more while controller and simulator run"
        )
    return (own or log.scenes)[-1]


def _read_scene(log: Log, message: SceneMessage) -> dict[str, Any]:
    try:
        scene: dict[str, Any] = _native.read_scene(message.yaml, message.file, []).to_dict()
    except ValueError as error:
        raise LogError(
            f"{log.path}: the scene in it, of {message.build!r}, is refused: {error}"
        ) from error
    return scene


def _control_points(robot: str, q: Floats) -> Floats:
    """Return the origins of the DH frames 1..6, (n, 6, 3) m; NaN where q is not finite."""
    points = np.full((len(q), 6, 3), np.nan)
    finite = np.isfinite(q).all(axis=1)
    if finite.any():
        points[finite] = _native.Arm(robot).frames(np.ascontiguousarray(q[finite]))[:, :, :3, 3]
    return points


def _goal_in_force(commands: Commands, scene_goal: list[float]) -> Floats:
    """Return the goal of every tick, (n, 3) m; under a stop request the last goal stays."""
    goal = np.vstack([scene_goal, commands.goal])
    known = np.r_[True, (commands.flags & FLAGS["stopped"]) == 0]
    newest: NDArray[np.int64] = np.maximum.accumulate(np.where(known, np.arange(len(goal)), 0))
    return goal[newest][1:]


def _smallest(t: Floats, commands: Commands) -> Nearest:
    known = np.where(np.isfinite(commands.clearance), commands.clearance, np.inf)
    row = int(np.argmin(known))
    if known[row] == np.inf:
        return Nearest(math.nan, 0, 0, math.nan)
    link, obstacle = int(commands.clearance_link[row]), int(commands.clearance_obstacle[row])
    return Nearest(float(known[row]), link, obstacle, float(t[row]))


def _compare(distances: Floats, reported: Floats, control_points: str) -> float:
    """Return the largest difference to the controller's own smallest distance, m; NaN = none.

    A controller that looks at the whole arm is nearer than the origins of the frames.
    """
    moving = distances[:, MOVING_POINTS]
    both = np.isfinite(moving).all(axis=1) & np.isfinite(reported)
    if control_points != "joints" or not both.any():
        return math.nan
    return float(np.abs(moving[both].min(axis=1) - reported[both]).max())


def _largest(values: Floats) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else math.nan


def _plain(value: Any) -> Any:
    """Return JSON values: what is not finite becomes null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
