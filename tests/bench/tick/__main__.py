"""./dev bench tick: time whole ticks, print JSON and a table."""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

# us, what p99.9 of the tick is held to among so many obstacles; reported, never a failure.
TARGETS = {"ur10_1000_obstacles": 50.0}
# us, the same for the median of the paper's cases with capsules.
MEDIAN_TARGETS = {f"c{n}": 1.0 for n in range(1, 5)}


def _table(results: dict[str, Any]) -> str:
    """Lay out the times, and the targets where there are some."""
    lines = [f"{'us a tick':22}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>9}"]
    for name, row in results.items():
        line = f"{name:22}" + "".join(
            f"{row[key] / 1e3:9.2f}" for key in ("p50", "p99", "p999", "max")
        )
        for key, targets in (("p999", TARGETS), ("p50", MEDIAN_TARGETS)):
            if name in targets:
                held = "held" if row[key] / 1e3 < targets[name] else "MISSED"
                line += f"  target {key} < {targets[name]:g}: {held}"
        lines.append(line)
    return "\n".join(lines)


def main() -> int:
    """Run the program and print what it measured."""
    parser = argparse.ArgumentParser(prog="./dev bench tick", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print JSON alone")
    options = parser.parse_args()
    program = Path("build/release/tests/bench_ticks")
    done = subprocess.run([program, "scenarios"], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        return done.returncode
    print(done.stdout, end="")
    if not options.json:
        print(_table(json.loads(done.stdout)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
