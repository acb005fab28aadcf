"""Runs of random scenes in several ways, and what they come to.

Lengths in m, times in s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

import leeway
from scenes.draw import draw_scene
from scenes.truth import Truth

REACHED, STAYED = 0.01, 0.02  # at some time, and at the end
STILL_BAND, STILL_S = 0.01, 4.0  # what ends within this band for so long stands

# The paper's gains, whatever the defaults are.
PAPER = {"law.control_points": "joints", "law.eta": 0.01, "law.rho_rep": 0.25, "law.approach_s": 0}
BARE = {"limits.clearance": "off", "law.remedy": "none"}
VARIANTS: dict[str, dict[str, Any]] = {
    "joints": PAPER | BARE,
    "capsules": BARE,
    "capsules + rollout": BARE | {"law.remedy": "rollout"},
    "capsules + rollout + guard": {"law.remedy": "rollout"},
}


@dataclass(frozen=True)
class Outcome:
    """What became of one scene in one way."""

    number: int
    moving: bool
    variant: str
    reached: bool
    clearance: float  # smallest, of the whole arm
    self_clearance: float
    time_to_goal: float  # s until within REACHED, infinite if never
    end: float  # deviation
    ending: str  # reached, standing or moving


def run_scene(
    seed: int, sets: dict[str, Any], variants: dict[str, dict[str, Any]], number: int
) -> list[Outcome]:
    """Draw a scene and run it in each way.

    Parameters
    ----------
    sets
        Keys that replace the defaults in every way that does not set them itself.
    """
    drawn = draw_scene(seed, number)
    scene = leeway.load_scene(drawn.text())
    arm = leeway.Arm("ur5")
    outcomes = []
    for name, changes in variants.items():
        run = leeway.simulate(scene.with_(sets | changes))
        near = np.flatnonzero(run.deviation <= REACHED)
        reached = len(near) > 0 and run.deviation[-1] <= STAYED
        late = run.deviation[run.t > run.t[-1] - STILL_S]
        still = np.ptp(late) < STILL_BAND
        outcomes.append(
            Outcome(
                number=number,
                moving=drawn.moving,
                variant=name,
                reached=bool(reached),
                clearance=float(Truth(drawn.obstacles, run.t).along(arm, run.q).min()),
                self_clearance=float(run.self_clearance.min()),
                time_to_goal=float(run.t[near[0]]) if len(near) else float("inf"),
                end=float(run.deviation[-1]),
                ending="reached" if reached else "standing" if still else "moving",
            )
        )
    return outcomes


def run_all(
    seed: int,
    numbers: Iterable[int],
    workers: int = 2,
    sets: dict[str, Any] | None = None,
    variants: dict[str, dict[str, Any]] = VARIANTS,
) -> Iterator[list[Outcome]]:
    """Run scenes, in their order."""
    one = partial(run_scene, seed, sets or {}, variants)
    if workers == 1:
        yield from map(one, numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one, numbers, chunksize=4)


def wilson(hits: int, count: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the interval of a rate by Wilson (1927), 95 % unless told."""
    if count == 0:
        return 0.0, 1.0
    rate, share = hits / count, z * z / count
    middle = (rate + share / 2) / (1 + share)
    half = z / (1 + share) * (rate * (1 - rate) / count + share / (4 * count)) ** 0.5
    return max(0.0, middle - half), min(1.0, middle + half)


def rate(hits: int, count: int) -> dict[str, Any]:
    """Return a rate and its interval."""
    return {"hits": hits, "of": count, "rate": hits / count, "interval": list(wilson(hits, count))}


def summarise(outcomes: list[Outcome]) -> dict[str, Any]:
    """Return rates and quantiles of runs of one way."""
    clearances = [o.clearance for o in outcomes]
    times = [o.time_to_goal for o in outcomes if o.reached]
    endings = [o.ending for o in outcomes]
    return {
        "reach": rate(sum(o.reached for o in outcomes), len(outcomes)),
        "collision": rate(sum(c < 0 for c in clearances), len(outcomes)),
        "clearance": _quantiles(clearances),
        "time_to_goal": _quantiles(times) if times else None,
        "endings": {kind: endings.count(kind) for kind in ("reached", "standing", "moving")},
    }


def _quantiles(values: list[float]) -> dict[str, float]:
    at = {"min": 0.0, "p05": 0.05, "p50": 0.5, "p95": 0.95, "max": 1.0}
    return {name: float(np.quantile(values, p)) for name, p in at.items()}


def results_of(seed: int, outcomes: list[Outcome]) -> dict[str, Any]:
    """Return everything as one JSON-able dictionary, each way for still, moving and all scenes."""
    ways = list(dict.fromkeys(o.variant for o in outcomes))
    groups = {"static": (False,), "moving": (True,), "all": (False, True)}
    found: dict[str, Any] = {"seed": seed, "count": len({o.number for o in outcomes})}
    for group, kinds in groups.items():
        chosen = [o for o in outcomes if o.moving in kinds]
        if chosen:
            found[group] = {w: summarise([o for o in chosen if o.variant == w]) for w in ways}
    return found


def rows_of(outcomes: list[Outcome]) -> list[dict[str, Any]]:
    """Return every run as a JSON-able row; what is infinite is null."""
    return [{k: None if v == float("inf") else v for k, v in asdict(o).items()} for o in outcomes]
