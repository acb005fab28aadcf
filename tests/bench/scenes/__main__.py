"""./dev bench scenes: run random scenes, print JSON and a table, draw a picture."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from scenes.picture import draw_picture
from scenes.study import Outcome, results_of, rows_of, run_all


def _rate(row: dict[str, Any]) -> str:
    low, high = row["interval"]
    return f"{100 * row['rate']:6.1f} % [{100 * low:5.1f}, {100 * high:5.1f}]"


def table(results: dict[str, Any]) -> str:
    """Lay out the rates and their intervals, the smallest clearance and the time to the goal."""
    lines = []
    for group in ("static", "moving", "all"):
        if group not in results:
            continue
        lines.append(
            f"{group:27}{'reached':>24}{'collided':>26}{'clearance min, p50':>22}{'s p50, p95':>14}"
        )
        for way, row in results[group].items():
            near, times = row["clearance"], row["time_to_goal"] or {"p50": 0, "p95": 0}
            lines.append(
                f"  {way:25}{_rate(row['reach'])}  {_rate(row['collision'])}"
                f"{1e3 * near['min']:10.1f}{1e3 * near['p50']:7.1f} mm"
                f"{times['p50']:9.2f}{times['p95']:7.2f}"
            )
    return "\n".join(lines)


def main() -> int:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="./dev bench scenes", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="scenes (1000)")
    parser.add_argument("--seed", type=int, default=1, help="what they are drawn from (1)")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="of every way that does not set it itself, as law.eta=0.005",
    )
    parser.add_argument("--json", action="store_true", help="print JSON alone")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/scenes"),
        metavar="DIR",
        help="where results.json, scenes.json and scenes.png go (runs/scenes)",
    )
    options = parser.parse_args()
    if options.count < 1 or options.workers < 1 or not all("=" in s for s in options.set):
        parser.error("--count and --workers are at least 1, --set is KEY=VALUE")
    sets = dict(s.split("=", 1) for s in options.set)
    console = Console(stderr=True)
    runs = run_all(options.seed, range(options.count), options.workers, sets)
    outcomes: list[Outcome] = []
    for found in track(
        runs, "scenes", options.count, console=console, disable=not console.is_terminal
    ):
        outcomes += found
    results = results_of(options.seed, outcomes)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    (options.out / "scenes.json").write_text(json.dumps(rows_of(outcomes)) + "\n")
    draw_picture(outcomes, options.out / "scenes.png")
    print(json.dumps(results, indent=1))
    if not options.json:
        print(table(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
