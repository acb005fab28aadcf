"""Picture of the study: reach rates, smallest clearances, times to the goal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from scenes.draw import DURATION_S
from scenes.study import Outcome, results_of


def draw_picture(outcomes: list[Outcome], path: Path) -> None:
    """Draw all runs into a PNG."""
    results = results_of(0, outcomes)
    ways = list(results["all"])
    figure, (rates, near, times) = plt.subplots(1, 3, figsize=(15, 4.5), layout="constrained")
    _draw_rates(rates, results, ways)
    for way in ways:
        chosen = [o for o in outcomes if o.variant == way]
        near.ecdf([1e3 * o.clearance for o in chosen], label=way)
        # What never reached counts in the share, beyond the right end.
        late = [o.time_to_goal if o.reached else 2 * DURATION_S for o in chosen]
        times.ecdf(late, label=way)
    near.axvline(0, color="0.5", linewidth=0.8)
    near.set(xlabel="smallest clearance of the run, mm", ylabel="share of scenes")
    times.set(xlabel="time to the goal, s", ylabel="share of scenes", xlim=(0, DURATION_S))
    times.legend(loc="upper left")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _draw_rates(axes: Any, results: dict[str, Any], ways: list[str]) -> None:
    """Draw the reach rate of each way with its interval, for each group of scenes."""
    groups = [g for g in ("static", "moving", "all") if g in results]
    for k, group in enumerate(groups):
        rows = [results[group][way]["reach"] for way in ways]
        rate = np.array([100 * row["rate"] for row in rows])
        ends = 100 * np.array([row["interval"] for row in rows]).T
        at = np.arange(len(ways)) + 0.2 * (k - (len(groups) - 1) / 2)
        axes.errorbar(rate, at, xerr=np.abs(ends - rate), fmt="o", capsize=3, label=group)
    axes.set_yticks(range(len(ways)), [way.replace(" + ", "\n+ ") for way in ways])
    axes.invert_yaxis()
    axes.set(xlabel="reached its goal, % (95 % interval)", xlim=(0, 100))
    axes.legend(loc="upper right")
