"""Measurements of `leeway bench`: repeated calls, and ratios to a peer in the same run."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import leeway
from leeway.scene import load_scene
from leeway.summary import scenario

SEED = 1
BATCH = 1000
REPEATS = 200


def measure(url: str | None, say: Callable[[str], None]) -> dict[str, Any]:
    """Measure everything.

    Returns
    -------
    One JSON-able dictionary: name -> {n, min, p50, p99, max} in the unit the name says, and ratios.

    Raises
    ------
    bus.BusError
        The lockstep run has no usable bus.
    """
    say("kinematics")
    results = _kinematics()
    say("pinocchio")
    results["pinocchio"] = _against_pinocchio()
    say("in-process run of C4")
    scene = load_scene(scenario("c4"))
    results["simulate_c4_ms"] = _summary(_time(lambda: leeway.simulate(scene), 50), 1e3)
    say("lockstep run of C4")
    results["lockstep_c4_s"] = _summary([_lockstep(url) for _ in range(5)], 1.0)
    return {"build": leeway.BUILD, **results}


def _time(call: Callable[[], object], repeats: int) -> list[float]:
    """Return the duration of each of several calls, s."""
    durations = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        durations.append(time.perf_counter() - start)
    return durations


def _summary(durations: list[float], scale: float) -> dict[str, float]:
    ordered = sorted(durations)
    at = [ordered[int((len(ordered) - 1) * p)] * scale for p in (0.0, 0.5, 0.99, 1.0)]
    return {"n": len(ordered), "min": at[0], "p50": at[1], "p99": at[2], "max": at[3]}


def _configurations(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.random.default_rng(SEED).uniform(-np.pi, np.pi, (count, 6))


def _kinematics() -> dict[str, Any]:
    """Time one configuration inside the C loop of a batch call."""
    results = {}
    q = _configurations(BATCH)
    for robot in ("ur5", "ur10"):
        arm = leeway.Arm(robot)
        results[f"fk_{robot}_ns"] = _summary(_time(lambda a=arm: a.fk(q), REPEATS), 1e9 / BATCH)  # type: ignore[misc]
        results[f"fk_and_jacobian_{robot}_ns"] = _summary(
            _time(lambda a=arm: a.jacobian(q), REPEATS),  # type: ignore[misc]
            1e9 / BATCH,
        )
    return results


def _pinocchio_model(pin: Any) -> Any:
    """Build the UR5 in pinocchio from its DH table (CB3 manual), the same numbers as Leeway's."""
    half = np.pi / 2
    table = [
        (0, 0.089159, half),
        (-0.425, 0, 0),
        (-0.39225, 0, 0),
        (0, 0.10915, half),
        (0, 0.09465, -half),
    ]
    model, placement, parent = pin.Model(), pin.SE3.Identity(), 0
    for i, (a, d, alpha) in enumerate([*table, (0, 0.0823, 0)]):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint{i + 1}")
        placement = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0, d]))
    model.addFrame(pin.Frame("tip", parent, placement, pin.FrameType.OP_FRAME))
    return model


def _against_pinocchio() -> dict[str, Any]:
    """Compare single Python calls, alternating, one configuration each."""
    try:
        import pinocchio as pin
    except ImportError:
        return {"installed": False, "hint": "pip install 'leeway[peers]'"}
    arm, model = leeway.Arm("ur5"), _pinocchio_model(pin)
    data, tip = model.createData(), model.getFrameId("tip")
    frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    calls = {
        "fk": (arm.fk, lambda q: pin.framesForwardKinematics(model, data, q)),
        "jacobian": (
            arm.jacobian,
            lambda q: pin.computeFrameJacobian(model, data, q, tip, frame),
        ),
    }
    results: dict[str, Any] = {"installed": True, "version": pin.__version__}
    for name, (ours, theirs) in calls.items():
        triples = [_triple(ours, theirs) for _ in range(30)]
        results[f"{name}_c_loop_over_call"] = _spread([loop / peer for loop, _, peer in triples])
        results[f"{name}_call_over_call"] = _spread([call / peer for _, call, peer in triples])
    q = _configurations(1)[0]
    difference = np.abs(
        arm.jacobian(q) - pin.computeFrameJacobian(model, data, q, tip, frame)
    ).max()
    results["jacobian_difference"] = float(difference)
    return results


def _spread(ratios: list[float]) -> dict[str, float]:
    return {"p50": statistics.median(ratios), "min": min(ratios), "max": max(ratios)}


def _triple(
    ours: Callable[[Any], object], theirs: Callable[[Any], object]
) -> tuple[float, float, float]:
    """Time the same configurations, s: in one batch call of ours, then call by call, both."""
    batch = _configurations(BATCH)

    def calls(function: Callable[[Any], object]) -> float:
        start = time.perf_counter()
        for q in batch:
            function(q)
        return time.perf_counter() - start

    return _time(lambda: ours(batch), 1)[0], calls(ours), calls(theirs)


def _lockstep(url: str | None) -> float:
    """Run C4 over the bus in lockstep; return the time between its first and last command, s."""
    from leeway.logs.log import read_log
    from leeway.run import RunConfig, run

    path = scenario("c4")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "c4.lcm"
        run(RunConfig(load_scene(path), path, log, lockstep=True, url=url))
        stamps = read_log(log).commands.mono_ns
    return float(stamps[-1] - stamps[0]) * 1e-9


def print_results(results: dict[str, Any]) -> None:
    """Print the medians as a table."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("measure", "n", "min", "p50", "p99", "max"):
        table.add_column(heading, justify="left" if heading == "measure" else "right")
    for name, value in results.items():
        if isinstance(value, dict) and "p99" in value:
            numbers = [f"{value[key]:.4g}" for key in ("min", "p50", "p99", "max")]
            table.add_row(name, str(value["n"]), *numbers)
    console = Console()
    console.print(table)
    peer = results["pinocchio"]
    if not peer["installed"]:
        console.print(f"pinocchio is not installed: {peer['hint']}", markup=False)
        return
    console.print(f"ratios to pinocchio {peer['version']}, called from Python, same run:")
    for name in ("fk", "jacobian"):
        for kind, text in (("c_loop", "C loop"), ("call", "Python call")):
            ratio = peer[f"{name}_{kind}_over_call"]
            spread = f"{ratio['p50']:.2f} [{ratio['min']:.2f}, {ratio['max']:.2f}]"
            console.print(f"  {name}, our {text}: {spread}", markup=False, soft_wrap=True)
