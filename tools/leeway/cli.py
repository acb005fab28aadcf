"""The command line `leeway`. Commands parse, call, print; the work is done in their modules."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from leeway import cli_machine, cli_obstacle, cli_replay
from leeway.options import EXIT_INTERRUPTED, EXIT_LOSS, EXIT_USAGE, Common, command, fail

if TYPE_CHECKING:
    from leeway.run import RunConfig

RECORD_TRIES = 3

app = typer.Typer(
    name="leeway",
    help="Run, record and look at UR arms that keep clear of obstacles.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
cli_machine.register(app)

SceneArg = Annotated[
    Path, typer.Argument(metavar="SCENE", help="Scene file, as scenarios/c1.yaml.")
]
LogArg = Annotated[Path, typer.Argument(metavar="LOG", help="LCM log, as runs/c1.lcm.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", "-s", metavar="KEY=VALUE", help="Replace a key of the scene. Repeatable."
    ),
]


def _load(path: Path, sets: list[str]) -> Any:
    from leeway.scene import load_scene

    try:
        return load_scene(path, sets)
    except OSError as error:
        fail(f"{path}: cannot read the scene: {error.strerror}", EXIT_USAGE)
    except ValueError as error:
        fail(str(error), EXIT_USAGE)


def _analyse(path: Path, name: str | None = None) -> Any:
    from leeway.logs.analysis import analyse
    from leeway.logs.log import LogError, read_log

    try:
        return analyse(read_log(path, name=name))
    except LogError as error:
        fail(str(error))


# --- run ---


@command(app, "run", "leeway run scenarios/c4.yaml --lockstep --set law.gamma=2 --set law.eta=20")
def run(
    scene: SceneArg,
    log: Annotated[
        Path | None, typer.Option(help="Log to write; default runs/SCENE-TIME.lcm.")
    ] = None,
    sets: SetOption = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="As fast as possible, always the same.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing log.")] = False,
    *,
    common: Common,
) -> None:
    """Run a scene: lcm-logger, simulator and controller as processes, recorded and summarised."""
    from leeway.run import LOG_FOLDER, drop_empty, take_log_name
    from leeway.summary import print_table

    if log and log.exists() and not force:
        fail(f"{log} exists: choose another --log, or --force", EXIT_USAGE)
    try:
        path = log or take_log_name(scene.stem)
    except OSError as error:
        fail(f"{LOG_FOLDER}: cannot write a log there: {error.strerror}")
    try:
        analysis, wall = _record(scene, path, sets or [], lockstep, common)
    finally:
        if log is None:
            drop_empty(path)
    if common.as_json:
        print(json.dumps({**analysis.to_json(), "log": str(path), "wall_s": wall}, indent=2))
    elif not common.quiet:
        print_table([analysis])
        print(f"log     {path}\nreport  leeway report {path}")
    _exit_with_losses([analysis])


def _missing(analysis: Any) -> int:
    """Count the messages of the motion that the log lacks."""
    losses: dict[str, int] = analysis.losses
    return losses["commands_not_in_log"] + losses["states_not_in_log"]


def _record(
    path: Path, log: Path, sets: list[str], lockstep: bool, common: Common
) -> tuple[Any, float]:
    """Run one scene and read its log.

    A lockstep run whose log lacks something is run again, at half the pace: the result is the same.
    """
    from leeway.run import RunConfig

    config = RunConfig(_load(path, sets), path, log, sets, lockstep, common.url, common.name)
    for _ in range(RECORD_TRIES if lockstep else 1):
        wall = _run_one(config, common)
        analysis = _analyse(log, common.name)
        if not _missing(analysis):
            break
        config = replace(config, pace=config.pace // 2)
    return analysis, wall


def _ending(log: Path, common: Common) -> str:
    """Say whether the arm is at rest at the end of a log."""
    from leeway.logs.analysis import analyse
    from leeway.logs.log import LogError, read_log

    try:
        moving = bool(analyse(read_log(log, common.name)).plant_qd[-1].any())
    except LogError:
        return "the arm had not moved yet"
    return "the arm was still moving" if moving else "the arm was brought to rest"


def _run_one(config: "RunConfig", common: Common) -> float:
    """Run one scene with a progress bar; end the program with a message when it fails."""
    from leeway import bus, processes
    from leeway.run import Interrupted, RunFailed, run
    from leeway.summary import progress_bar

    log, duration = config.log, config.scene.to_dict()["duration_s"]
    try:
        with progress_bar(config.path.stem, duration, common.silent) as advance:
            return run(config, advance)
    except Interrupted as error:
        fail(f"{error}: {_ending(log, common)}; log: {log}", EXIT_INTERRUPTED)
    except OSError as error:
        fail(f"{log}: cannot write the log: {error.strerror}")
    except RunFailed as error:
        fail(f"{error}\n  everything else was stopped; log: {log}")
    except (bus.BusError, processes.ProgramMissing) as error:
        fail(str(error))


def _exit_with_losses(analyses: list[Any]) -> None:
    """End with status 3 when a log lacks something."""
    problems = []
    for a in analyses:
        missing = _missing(a)
        if a.truncated_bytes:
            cut = f"{a.truncated_bytes} bytes after the last whole event were left out"
            problems.append(f"{a.path}: cut in the middle: {cut}")
        if missing:
            problems.append(f"{a.path}: {missing} messages of the motion are missing in the log")
    for problem in problems:
        print(f"leeway: {problem}", file=sys.stderr)
    if problems:
        raise typer.Exit(EXIT_LOSS)


@command(app, "keys", "leeway keys")
def keys(*, common: Common) -> None:
    """List every key that a scene may have, with unit, range, default and meaning."""
    from leeway._native import describe_scene

    text = describe_scene()
    print(json.dumps({"keys": text}) if common.as_json else text.rstrip())


# --- logs ---


@command(app, "report", "leeway report runs/c1.lcm runs/c2.lcm -o report")
def report(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="One log, or several to compare.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder to write; default LOG.report.")
    ] = None,
    *,
    common: Common,
) -> None:
    """Turn logs into one self-contained HTML page with PNG twins of every picture."""
    analyses = [_analyse(log, common.name) for log in logs]
    _present(analyses, out or logs[0].with_suffix(".report"), common)


def _present(analyses: list[Any], out: Path, common: Common) -> None:
    """Write the report, print the table and where everything is."""
    from leeway.summary import print_table

    page = _write_report(analyses, out, common.silent)
    if common.as_json:
        print(json.dumps({"report": str(page), "logs": [a.to_json() for a in analyses]}, indent=2))
    elif not common.quiet:
        print_table(analyses)
        print(f"logs    {' '.join(str(a.path) for a in analyses)}\nreport  {page}")
    _exit_with_losses(analyses)


def _write_report(analyses: list[Any], out: Path, quiet: bool) -> Path:
    from leeway.report import write_report
    from leeway.summary import status_line

    try:
        with status_line("report", quiet) as say:
            return write_report(analyses, out, say)
    except OSError as error:
        fail(f"{out}: cannot write the report: {error.strerror}")


@command(app, "info", "leeway info runs/c1.lcm")
def info(log: LogArg, *, common: Common) -> None:
    """Tell what a log holds: programs, scene, channels, events, the numbers of the run."""
    from leeway.summary import print_info

    analysis = _analyse(log, common.name)
    if common.as_json:
        print(json.dumps(analysis.to_json(), indent=2))
    elif not common.quiet:
        print_info(analysis)
    _exit_with_losses([analysis])


cli_replay.register(app)

# --- bus ---


def _send(what: str, send: Callable[[Any], Any], common: Common) -> None:
    """Send a message until a controller echoes it, and say so."""
    from leeway import bus

    try:
        command = send(bus.open_bus(bus.resolve_url(common.url)))
    except bus.NotTaken as error:
        fail(f"{what}: sent, but {error}")
    except bus.BusError as error:
        fail(str(error))
    if command is None:
        fail(
            f"{what}: sent, but no controller answered within {bus.PATIENCE_S:g} s: "
            "is leeway-controller running on this bus (same --lcm-url, same --name)?"
        )
    if common.as_json:
        print(
            json.dumps(
                {"done": what, "obstacles": command.obstacle_count, "deviation": command.deviation}
            )
        )
    elif not common.quiet:
        print(
            f"{what}: the controller has it ({command.obstacle_count} obstacles, "
            f"tip {command.deviation:.3f} m from the goal)"
        )


@command(
    app, "goal", "leeway goal -0.4 -0.5 0.3", context_settings={"ignore_unknown_options": True}
)
def goal(
    x: Annotated[float, typer.Argument(help="m, base frame.")],
    y: Annotated[float, typer.Argument(help="m, base frame.")],
    z: Annotated[float, typer.Argument(help="m, base frame.")],
    *,
    common: Common,
) -> None:
    """Send the tip to another goal, now."""
    from leeway import bus

    _check_point((x, y, z))
    _send(f"goal {x:g} {y:g} {z:g}", lambda b: bus.send_goal(b, common.name, (x, y, z)), common)


@command(app, "stop", "leeway stop   (a later `leeway goal` sets the arm in motion again)")
def stop(*, common: Common) -> None:
    """Brake the arm to rest and keep it there until the next goal."""
    from leeway import bus

    _send("stop", lambda b: bus.send_goal(b, common.name, None), common)


def _check_point(point: tuple[float, float, float]) -> None:
    if not all(abs(v) <= 100 for v in point):
        fail(f"expected three numbers from -100 to 100 (m), found {point}", EXIT_USAGE)


cli_obstacle.register(app, _send)

# --- demo and bench ---


@command(app, "demo", "leeway demo -o runs/demo")
def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for logs and report.")] = Path(
        "runs/demo"
    ),
    lockstep: Annotated[bool, typer.Option("--lockstep", help="As fast as possible.")] = False,
    *,
    common: Common,
) -> None:
    """Run the paper's cases C1 to C4 in real time, and make the report that compares them."""
    from leeway.summary import scenario

    cases = ("c1", "c2", "c3", "c4")
    logs = [out / f"{case}.lcm" for case in cases]
    analyses = [
        _record(scenario(case), log, [], lockstep, common)[0]
        for case, log in zip(cases, logs, strict=True)
    ]
    _present(analyses, out / "report", common)


@command(app, "bench", "leeway bench --json")
def bench(*, common: Common) -> None:
    """Measure kinematics and runs; with pinocchio installed, also the ratio to it."""
    from leeway.bench import measure, print_results
    from leeway.bus import BusError
    from leeway.summary import status_line

    try:
        with status_line("bench", common.silent) as say:
            results = measure(common.url, say)
    except BusError as error:
        fail(str(error))
    if common.as_json:
        print(json.dumps(results, indent=2))
    elif not common.quiet:
        print_results(results)
