"""The live programs at their edges: prompt answers, slow rates, short faults, endings."""

import array
import contextlib
import fcntl
import json
import os
import signal
import subprocess
import termios
import time

import lcm
import pytest
from helpers import Listener, kill, running, wait_until
from leeway_lcm import leeway as wire

from leeway.bus import header, resolve_url
from leeway.processes import program

pytestmark = pytest.mark.usefixtures("private_network")
INT64_MAX = (1 << 63) - 1
ON_ONE_CPU = ("taskset", "-c", str(min(os.sched_getaffinity(0))))


def _command(state, session, seq):
    """Return a command for a state that asks for no motion."""
    command = wire.joint_command_t()
    command.h = header(session, seq)
    command.plant_session, command.state_seq = state.h.session, state.h.seq
    command.state_tick, command.mode = state.tick, command.VELOCITY
    return command.encode()


def _moving(state):
    return state.tick > 10 and max(map(abs, state.qd)) > 0.05


def test_an_answer_is_never_too_early(root):
    # On one CPU, without priorities, the answer often comes before the plant is back from sending.
    scene = root / "scenarios" / "reach.yaml"
    options = ("-q", "--rt=off", "--set=rate_hz=1000", "--set=plant.timeout_s=2")
    command = [*ON_ONE_CPU, program("leeway-simulator"), scene, *options]
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    simulator = subprocess.Popen([str(c) for c in command])
    try:
        listener = Listener()
        answered = 0

        def answer(_, data):
            nonlocal answered
            answered += 1
            listener.bus.publish(
                "JOINT_COMMAND", _command(wire.joint_state_t.decode(data), 7, answered)
            )

        listener.bus.subscribe("JOINT_STATE", answer)
        status = listener.wait_for("PLANT_STATUS", lambda s: s.taken > 1500, seconds=20)
        assert status.refused[status.STALE] == 0
    finally:
        os.sched_setaffinity(0, before)
        simulator.terminate()
        simulator.wait(5)


def test_no_plant_slows_the_controller_down(root):
    # Every period is a tick or counted as skipped, also when states claim to come once a second.
    scene = root / "scenarios" / "reach.yaml"
    with running("leeway-controller", scene, "--post-mortem=none"):
        listener = Listener()
        commands = []
        listener.bus.subscribe(
            "JOINT_COMMAND", lambda _, data: commands.append(wire.joint_command_t.decode(data))
        )
        world, state = wire.obstacles_t(), wire.joint_state_t()
        world.h, world.op = header(9, 1), world.REPLACE
        listener.wait_for("JOINT_COMMAND", lambda c: not c.flags & c.WARMING_UP)
        listener.bus.publish("OBSTACLES", world.encode())
        state.q, state.period_ns = [0.1] * 6, 10**9
        for seq in range(1, 801):
            state.h = header(4, seq)
            listener.bus.publish("JOINT_STATE", state.encode())
            due = time.monotonic() + 0.002
            while (left := due - time.monotonic()) > 0:
                listener.bus.handle_timeout(1 + int(left * 1000))
    first, last = commands[0], commands[-1]
    assert any(c.mode == c.VELOCITY for c in commands)
    counted = last.tick - first.tick + last.skipped - first.skipped
    elapsed = (last.tick_ns - first.tick_ns) / 2e6
    assert counted == pytest.approx(elapsed, rel=0.05, abs=3)


def test_a_slow_controller_keeps_its_lease(root):
    slow = ("-q", "--set=rate_hz=4", "--set=plant.timeout_s=1", "--set=duration_s=60")
    with running("leeway-simulator", root / "scenarios" / "reach.yaml", *slow):
        listener = Listener()
        for seq in range(1, 9):
            state = listener.wait_for("JOINT_STATE", lambda _: True)
            listener.bus.publish("JOINT_COMMAND", _command(state, 7, seq))
            time.sleep(0.18)  # the moment that is tested: the owner is silent, and in time
            listener.bus.publish("JOINT_COMMAND", _command(state, 8, seq))
        status = listener.wait_for("PLANT_STATUS", lambda s: s.refused[s.FOREIGN] > 0)
        assert (status.peer_session, status.takeovers) == (7, 0)


def test_no_message_keeps_the_controller_from_its_end(root):
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-simulator", scene),
        running("leeway-controller", scene, "--post-mortem=none") as controller,
    ):
        listener = Listener()
        listener.wait_for("JOINT_STATE", _moving)
        stop, goal = wire.stop_t(), wire.goal_t()
        stop.h, goal.h, goal.p = header(INT64_MAX, INT64_MAX), header(5, 1), [0.2, -0.6, 0.4]
        listener.bus.publish("STOP", stop.encode())
        listener.wait_for("JOINT_COMMAND", lambda c: c.request_session == INT64_MAX)
        listener.bus.publish("GOAL", goal.encode())
        listener.wait_for("JOINT_COMMAND", lambda c: c.request_session == 5)
        listener.wait_for("JOINT_STATE", _moving)
        controller.send_signal(signal.SIGTERM)
        assert controller.wait(2) == 0
        assert not any(listener.wait_for("JOINT_STATE", lambda s: not any(s.qd)).qd)


def test_a_short_fault_has_its_file(root, tmp_path):
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-simulator", scene) as simulator,
        running("leeway-controller", scene, f"--post-mortem={tmp_path}"),
    ):
        listener = Listener()
        listener.wait_for("JOINT_STATE", _moving)
        peer_timeout = wire.status_t.PEER_TIMEOUT
        for _ in range(20):  # a stop of about the controller's patience, until it was one beyond
            kill(simulator.pid, signal.SIGSTOP)
            time.sleep(0.025)
            kill(simulator.pid, signal.SIGCONT)
            for _ in range(3):
                status = listener.wait_for("STATUS", lambda _: True)
            if status.faults_ever & peer_timeout:
                break
        assert status.faults_ever & peer_timeout
        wait_until(lambda: any(tmp_path.glob("*peer-timeout*.lcm")), 2, "post-mortem file")


def test_two_controllers_that_fault_at_once_write_two_files(root, tmp_path):
    scene, folder = root / "scenarios" / "reach.yaml", f"--post-mortem={tmp_path}"
    with (
        running("leeway-simulator", scene, "--name=A") as a,
        running("leeway-simulator", scene, "--name=B") as b,
        running("leeway-controller", scene, "--name=A", folder) as one,
        running("leeway-controller", scene, "--name=B", folder) as two,
    ):
        own = lcm.LCM(resolve_url(None))
        moving = set()
        for name in "AB":
            own.subscribe(
                f"{name}_JOINT_STATE",
                lambda channel, data: (
                    moving.add(channel[0]) if _moving(wire.joint_state_t.decode(data)) else None
                ),
            )
        wait_until(lambda: own.handle_timeout(50) and len(moving) == 2, 10, "motion of both")
        for simulator in (a, b):
            kill(simulator.pid)
        for controller in (one, two):
            wait_until(lambda c=controller: _file_of(tmp_path, c.pid), 3, "post-mortem file")
    for name, controller in (("A", one), ("B", two)):
        (found,) = _file_of(tmp_path, controller.pid)
        channels = {event.channel for event in lcm.EventLog(str(found))}
        assert channels == {f"{name}_{c}" for c in ("SCENE", "JOINT_STATE", "JOINT_COMMAND")} | {
            "OBSTACLES"
        }


def _file_of(folder, pid):
    """Return the post-mortem files of a process."""
    return list(folder.glob(f"postmortem-*-{pid}.lcm"))


def test_a_slow_disk_keeps_nobody_from_being_heard(root, tmp_path):
    scene = root / "scenarios" / "reach.yaml"
    with contextlib.ExitStack() as stack:
        simulator = stack.enter_context(running("leeway-simulator", scene))
        controller = stack.enter_context(
            running("leeway-controller", scene, f"--post-mortem={tmp_path}")
        )
        readers = []
        stack.callback(lambda: [os.close(reader) for reader in readers])
        # Pipes that nobody empties, one for each second in which the fault may come.
        now = time.time()
        for second in range(-1, 20):
            when = time.strftime("%Y%m%d-%H%M%S", time.localtime(now + second))
            path = tmp_path / f"postmortem-{when}-peer-timeout-{controller.pid}.lcm"
            os.mkfifo(path)
            readers.append(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
        listener = Listener()
        listener.wait_for("JOINT_STATE", _moving)
        kill(simulator.pid)
        wait_until(lambda: any(map(_is_full, readers)), 5, "full pipe")
        stop = wire.stop_t()
        stop.h = header(5, 1)
        listener.bus.publish("STOP", stop.encode())
        listener.wait_for("JOINT_COMMAND", lambda c: c.request_session == 5, seconds=2)


def _is_full(reader):
    """Whether a pipe holds so much that its writer waits."""
    waiting = array.array("i", [0])
    fcntl.ioctl(reader, termios.FIONREAD, waiting)
    return waiting[0] > 60000


def test_the_end_of_a_plant_is_no_fault_and_no_work(root, tmp_path):
    scene, statistics = root / "scenarios" / "reach.yaml", tmp_path / "plant.json"
    patient = ("--set=plant.timeout_s=1", "--set=rate_hz=50", "--set=duration_s=1")
    for ending in ("signal", "done"):
        options = (f"--histogram={statistics}", *(["--until-done"] if ending == "done" else []))
        with (
            running("leeway-controller", scene, "--post-mortem=none", *patient),
            running("leeway-simulator", scene, *patient, *options) as simulator,
        ):
            listener = Listener()
            listener.wait_for("JOINT_STATE", _moving)
            if ending == "signal":
                simulator.terminate()
            last = listener.wait_for("PLANT_STATUS", lambda s: s.state == s.ENDING)
            assert simulator.wait(5) == 0
            assert not last.faults_ever & last.PEER_TIMEOUT, ending
            # One period is 20 ms; a step of the plant takes some 20 us.
            assert json.loads(statistics.read_text())["exec_us"]["max_ns"] < 10e6, ending


def test_a_second_signal_ends_the_simulator_at_once(root):
    scene = root / "scenarios" / "reach.yaml"
    slow = [f"--set={who}.acceleration=0.02" for who in ("limits", "plant")]
    with (
        running("leeway-controller", scene, "--post-mortem=none", *slow),
        running("leeway-simulator", scene, *slow) as simulator,
    ):
        listener = Listener()
        listener.wait_for("JOINT_STATE", _moving)
        simulator.send_signal(signal.SIGINT)
        listener.wait_for("JOINT_STATE", lambda s: s.plant_mode == s.STOPPING)
        simulator.send_signal(signal.SIGINT)
        assert simulator.wait(1) == 130  # the ramp alone takes 2.5 s
        assert any(listener.wait_for("JOINT_STATE", lambda s: s.plant_mode == s.ENDED).qd)


def test_words_that_nobody_reads_end_no_program(root):
    scene = root / "scenarios" / "reach.yaml"
    reader, writer = os.pipe()
    simulator = subprocess.Popen([str(program("leeway-simulator")), str(scene)], stderr=writer)
    os.close(writer)
    try:
        listener = Listener()
        listener.wait_for("JOINT_STATE", lambda _: True)
        os.close(reader)
        with running("leeway-controller", scene, "--post-mortem=none") as controller:
            listener.wait_for("JOINT_STATE", _moving)
            kill(controller.pid)  # the simulator says that commands cease
            listener.wait_for("JOINT_STATE", lambda s: s.plant_mode == s.STOPPING and not any(s.qd))
        simulator.terminate()
        assert simulator.wait(5) == 0
    finally:
        if simulator.poll() is None:
            simulator.kill()


def test_what_cannot_be_sent_is_said_once(root):
    # Words for every message fill a pipe that nobody empties, and then no signal is heard any more.
    scene = root / "scenarios" / "reach.yaml"
    with (
        running("leeway-simulator", scene) as simulator,
        running("leeway-controller", scene, "--post-mortem=none") as controller,
    ):
        listener = Listener()
        listener.wait_for("JOINT_STATE", _moving)
        _ip("link set lo down")
        try:
            time.sleep(1)  # 20 messages
        finally:
            for command in ("link set lo up", "link set lo multicast on"):
                _ip(command)
            _ip("route replace 224.0.0.0/4 dev lo")
        listener.wait_for("JOINT_STATE", lambda s: s.plant_mode == s.MOVING)
        for channel in ("STATUS", "PLANT_STATUS"):
            listener.wait_for(channel, lambda s: s.unsent > 0)
        for process, channel in ((controller, "STATUS"), (simulator, "PLANT_STATUS")):
            process.terminate()
            said = process.communicate(timeout=5)[1].splitlines()
            for words in ("cannot be sent", "is sent again"):
                assert sum(line.endswith(f": {channel} {words}") for line in said) == 1, said


def _ip(arguments):
    subprocess.run(["ip", *arguments.split()], check=True)


def test_statistics_that_cannot_be_written_are_a_failure(root):
    scene = root / "scenarios" / "reach.yaml"
    with running("leeway-controller", scene, "--histogram=/dev/full") as controller:
        Listener().wait_for("JOINT_COMMAND", lambda c: not c.flags & c.WARMING_UP)
        controller.terminate()
        said = controller.communicate(timeout=5)[1]
    assert controller.returncode == 1
    assert "/dev/full: cannot write the statistics: No space left on device" in said
