"""Obstacles of every shape in logs and pictures: distances, what is in force, surfaces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from leeway_lcm import leeway as wire
from log_maker import PERIOD_NS, SOURCE, Run, analysed, obstacles, see, stamp, texts

import leeway
from leeway.logs import solids
from leeway.logs.log import Floats, read_log
from leeway.logs.solids import Obstacle
from leeway.logs.world import follow
from leeway.report.solids import faces, polygon_in

CORNERS = ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.4, 0.0), (0.1, 0.0, 0.5))


def make(shape: int, random: np.random.Generator) -> Obstacle:
    """Return an obstacle in any place."""
    quat = random.normal(size=4)
    x, y, z = random.uniform(-1, 1, 3).tolist()
    return Obstacle(
        id=1,
        p=(x, y, z),
        radius=0.0 if shape == solids.HALFSPACE else 0.05,
        session=1,
        shape=shape,
        quat=tuple((quat / np.linalg.norm(quat)).tolist()),
        size={solids.CAPSULE: (0.3, 0.0, 0.0), solids.BOX: (0.1, 0.2, 0.3)}.get(shape, (0, 0, 0)),
        vertices=CORNERS if shape == solids.HULL else (),
    )


def native(o: Obstacle) -> tuple[leeway.Shape, Floats]:
    """Return the shape and the pose that the C code measures."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = o.rotation, o.p
    shapes = {
        solids.SPHERE: lambda: leeway.Sphere(o.radius),
        solids.CAPSULE: lambda: leeway.Capsule(o.radius, o.size[0]),
        solids.BOX: lambda: leeway.Box(o.size, o.radius),
        solids.HULL: lambda: leeway.Hull(o.vertices, o.radius),
        solids.HALFSPACE: lambda: leeway.HalfSpace([0, 0, 1], 0),
    }
    return shapes[o.shape](), pose


@pytest.mark.parametrize("shape", range(4))
def test_surfaces_lie_on_the_solid(shape: int) -> None:
    random = np.random.default_rng(shape)
    for _ in range(10):
        o = make(shape, random)
        o = Obstacle(**vars(o) | {"radius": 0.0}) if shape in (solids.BOX, solids.HULL) else o
        points = np.vstack(faces(o.core, o.radius))
        poses = np.broadcast_to(np.eye(4), (len(points), 4, 4)).copy()
        poses[:, :3, 3] = points
        away = leeway.distance(leeway.Sphere(0), poses, *native(o)).distance
        np.testing.assert_allclose(away, 0, atol=1e-9)


def test_a_box_has_six_faces_and_its_rounding_is_added() -> None:
    o = Obstacle(1, (0.0, 0.0, 0.0), 0.1, 1, solids.BOX, size=(0.1, 0.2, 0.3))
    found = faces(o.core, o.radius)
    assert sorted(len(face) for face in found) == [4] * 6
    np.testing.assert_allclose(np.abs(np.vstack(found)).max(axis=0), [0.2, 0.3, 0.4])
    area = sum(np.linalg.norm(np.cross(f[1] - f[0], f[2] - f[1])) for f in found)
    assert area == pytest.approx(8 * (0.2 * 0.3 + 0.2 * 0.4 + 0.3 * 0.4))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_flat_and_collinear_hulls_have_a_surface(n: int) -> None:
    line = np.outer(np.arange(n), [0.1, 0.2, 0.0])
    assert len(faces(line, 0.0)) > 0
    assert len(faces(np.vstack([line, [0.3, 0.0, 0.0]]), 0.01)) > 0


def test_a_plane_is_cut_by_the_picture() -> None:
    low, high = np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0])
    table = Obstacle(1, (5.0, 5.0, 0.25), 0.0, 1, solids.HALFSPACE)
    corners = polygon_in(table, low, high)
    assert sorted(map(tuple, corners.round(9).tolist())) == [
        (x, y, 0.25) for x in (-1.0, 1.0) for y in (-1.0, 1.0)
    ]
    below = Obstacle(1, (0.0, 0.0, -3.0), 0.0, 1, solids.HALFSPACE)
    assert len(polygon_in(below, low, high)) == 0


# --- in force ---


def hull_message(seq: int, time_ns: int = 0, valid_for_ms: int = 0) -> Any:
    """Return a HULL message of obstacle 5."""
    m = stamp(wire.hull_t(), SOURCE, seq)
    m.time_ns, m.valid_for_ms, m.n = time_ns, valid_for_ms, len(CORNERS)
    m.o = wire.obstacle_t()
    m.o.id, m.o.shape, m.o.quat, m.o.radius = 5, m.o.HULL, [1, 0, 0, 0], 0.01
    m.vertex = [list(CORNERS[k]) if k < m.n else [0, 0, 0] for k in range(m.MAX)]
    return m


def moved(seq: int, x: float) -> Any:
    """Return an OBSTACLES message that names the hull without its vertices."""
    m = obstacles(SOURCE, seq, 0, [(5, (x, 0.0, 0.0), 0.01)])
    m.o[0].shape = m.o[0].HULL
    return m


def test_a_hull_is_moved_by_its_name(tmp_path: Path) -> None:
    run = Run(ticks=12)
    run.inserted = {
        2: [("OBSTACLES", moved(1, 0.5))],  # not known yet: refused
        4: [("HULL", hull_message(1))],
        6: [("OBSTACLES", moved(2, 0.7))],
    }
    see(run, slice(4, 12), SOURCE, 1, hull=True)
    for command in run.commands[7:]:
        command.world_channel, command.world_seq = command.OBSTACLES, 2
    log = read_log(run.write(tmp_path))
    line = follow(log, log.commands, np.zeros((len(log.commands), 6, 3))).line
    found = [{o.id: o for o in line.worlds[i]} for i in line.index]
    assert line.unknown_ticks == 0
    assert 5 not in found[3]
    assert (found[4][5].p[0], found[4][5].vertices) == (0.0, CORNERS)
    assert (found[8][5].p[0], found[8][5].vertices) == (0.7, CORNERS)
    events = texts(analysed(run, tmp_path), "obstacle")
    assert any("obstacle 5 added: hull of 4 vertices at (0, 0, 0) m" in text for text in events)


def test_what_expires_is_gone(tmp_path: Path) -> None:
    run = Run(ticks=12)
    message = obstacles(SOURCE, 1, 0, [(7, (1.0, 0.0, 0.0), 0.1)])
    message.time_ns, message.valid_for_ms = 2 * PERIOD_NS, 4 * PERIOD_NS // 1_000_000
    run.inserted[2] = [("OBSTACLES", message)]
    see(run, slice(3, 12), SOURCE, 1)
    log = read_log(run.write(tmp_path))
    line = follow(log, log.commands, np.zeros((len(log.commands), 6, 3))).line
    there = [any(o.id == 7 for o in line.worlds[i]) for i in line.index]
    assert np.flatnonzero(there).tolist() == [3, 4, 5]
