"""Command line of the real-time bench: what to measure, the session, the results."""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NoReturn

from leeway.processes import ProgramMissing
from leeway.summary import progress_bar
from rt.jobs import JobFailed
from rt.load import FLOOD_HZ, STRESS, running_load
from rt.machine import PACKAGES, describe, kept_awake
from rt.results import Slices, condition_results
from rt.slices import CONTENDERS, WARM_UP_S, Plan
from rt.tables import show

BUILD = Path(__file__).resolve().parents[3] / "build" / "dev" / "tests"
RATES = [125, 500, 1000, 2000, 5000]
OVERHEAD_S = 0.4  # start and end of a slice
FAILED, INTERRUPTED = 1, 130


def _number(what: str, low: float, high: float) -> Callable[[str], float]:
    """Make a reader of numbers within bounds, which says what it wanted."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = float("nan")
        if not low <= number <= high:
            raise argparse.ArgumentTypeError(f"expected {what}, found {text!r}")
        return number

    return read


def _whole(what: str, high: int) -> Callable[[str], int]:
    """Make a reader of whole numbers from 1 on."""
    number = _number(what, 1, high)

    def read(text: str) -> int:
        if number(text) % 1:
            raise argparse.ArgumentTypeError(f"expected {what}, found {text!r}")
        return int(number(text))

    return read


def _rates(text: str) -> list[float]:
    return [_number("rates from 1 to 10000 Hz", 1, 10_000)(part) for part in text.split(",")]


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="./dev bench rt",
        description="Leeway's loops against cyclictest and its bus against bare UDP multicast, "
        "idle and loaded, as ratios of one session.",
        epilog="example: ./dev bench rt --rates 1000 --alternations 20 --json runs/rt.json",
    )
    add = parser.add_argument
    add("--quick", action="store_true", help="1000 Hz only, 3 alternations: a look, no result")
    add("--rates", type=_rates, metavar="HZ,HZ", help="default 125,500,1000,2000,5000")
    count, seconds = _whole("a whole number > 0", 10**6), _whole("whole seconds > 0", 3600)
    add("--alternations", type=count, metavar="N", help="slices of each kind, default 10")
    # cyclictest takes whole seconds.
    add("--slice", type=seconds, metavar="S", default=3, help="whole seconds, default 3")
    add("--seed", type=int, metavar="N", help="of the order; default: drawn and printed")
    add("--json", type=Path, metavar="FILE", help="write everything as JSON, histograms too")
    options = parser.parse_args(arguments)
    options.rates = options.rates or ([1000.0] if options.quick else list(map(float, RATES)))
    options.alternations = options.alternations or (3 if options.quick else 10)
    options.seed = random.SystemRandom().randrange(10**6) if options.seed is None else options.seed
    return options


def missing_tools() -> str | None:
    """Return one message on what to install, None when everything is there."""
    missing = [tool for tool in PACKAGES if shutil.which(tool) is None]
    if not missing:
        return None
    packages = " ".join(PACKAGES[tool] for tool in missing)
    return (
        f"{' and '.join(missing)} not found: "
        f"sudo apt-get install --no-install-recommends -y {packages}"
    )


def make_order(seed: int, alternations: int) -> list[list[str]]:
    """Every alternation has each contender once, in an order of its own."""
    rng = random.Random(seed)
    return [rng.sample(list(CONTENDERS), len(CONTENDERS)) for _ in range(alternations)]


def measure_condition(
    plan: Plan, rate_hz: float, order: list[list[str]], loaded: bool, done: Callable[[], None]
) -> dict[str, Any]:
    """Alternate all contenders at one rate under one load, which runs through."""
    slices: Slices = {name: [] for name in CONTENDERS}
    flood_hz: dict[str, float] = {}
    with ExitStack() as stack:
        load = stack.enter_context(running_load(BUILD / "bench_flood")) if loaded else None
        for turn in order:
            for name in turn:
                slices[name].append(CONTENDERS[name](plan, rate_hz))
                if load:
                    load.check()
                done()
        if load:
            flood_hz = {name: load.flood_hz([s.span for s in slices[name]]) for name in CONTENDERS}
    results = condition_results(slices, rate_hz, loaded)
    return {**results, "order": order, "flood_hz": flood_hz}


class Session:
    """All conditions one after the other; those finished are kept when something ends it early."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.conditions: list[dict[str, Any]] = []
        self.planned = [(rate, loaded) for rate in options.rates for loaded in (False, True)]
        self.slice_s = options.slice + OVERHEAD_S + WARM_UP_S
        self.total_s = self.slice_s * len(self.planned) * options.alternations * len(CONTENDERS)

    def run(self) -> None:
        """Measure."""
        options, passed_s = self.options, 0.0
        with (
            kept_awake(),
            tempfile.TemporaryDirectory(prefix="leeway-bench-") as folder,
            progress_bar("bench rt", self.total_s, False) as advance,
        ):

            def done() -> None:
                nonlocal passed_s
                passed_s += self.slice_s
                advance(passed_s)

            plan = Plan(options.slice, BUILD / "bench_pingpong", Path(folder))
            for number, (rate_hz, loaded) in enumerate(self.planned):
                order = make_order(options.seed + number, options.alternations)
                self.conditions.append(measure_condition(plan, rate_hz, order, loaded, done))

    def document(self) -> dict[str, Any]:
        """Return everything, JSON-able."""
        options = self.options
        return {
            "machine": describe(),
            "options": {
                "rates_hz": options.rates,
                "alternations": options.alternations,
                "slice_s": options.slice,
                "seed": options.seed,
                "stress": STRESS,
                "flood_hz": FLOOD_HZ,
            },
            "complete": len(self.conditions) == len(self.planned),
            "conditions": self.conditions,
        }


def _end(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _say(text: str) -> None:
    print(f"bench rt: {text}", file=sys.stderr)


def _report(session: Session) -> None:
    """Show and write what was measured."""
    if not session.conditions:
        return
    document = session.document()
    if session.options.json:
        session.options.json.parent.mkdir(parents=True, exist_ok=True)
        session.options.json.write_text(json.dumps(document, indent=1) + "\n")
    show(document)


def main() -> int:
    """Entry point; returns the exit status."""
    options = parse()
    message = missing_tools()
    if message:
        _say(message)
        return FAILED
    signal.signal(signal.SIGTERM, _end)
    # Everyone on the default bus, whatever this shell uses.
    os.environ.pop("LCM_DEFAULT_URL", None)
    session = Session(options)
    _say(f"takes about {session.total_s / 60:.1f} min, seed {options.seed}")
    status = 0
    try:
        session.run()
    except KeyboardInterrupt:
        _say(f"interrupted after {len(session.conditions)} of {len(session.planned)} conditions")
        status = INTERRUPTED
    except (JobFailed, ProgramMissing, ValueError) as error:
        _say(str(error))
        status = FAILED
    _report(session)
    return status


if __name__ == "__main__":
    sys.exit(main())
