"""Plans for point masses in a plane and in space: Newton's law, streams, G-code, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.planning.cable_streams import cable_stream
from cdpr_drake.errors import PlanningError, RobotFileError
from tests.analyses.planning.plan_command import WRITES, undrawn
from tests.analyses.planning.plan_command import run as run_plan

NEWTON = 1e-9
"""Share of the largest tension: sums of a few forces in doubles."""

G_CODE = "G21 G90\nG0 X2000 Y1500\nG1 X2100 Y1600 F3000\nG2 X2200 Y1500 I50 J-50\nG1 X2000 Y1500\n"
"""Lines and an arc on Maslow's board [mm], 50 mm/s."""


def in_space():
    """Four cables from above and one from below that hold a point mass."""
    robot = cdpr.load_robot("gt_graffiti")
    corners = [[1.5, 0.0, 0.0], [0.0, 0.0, 2.3], [3.0, -1.0, 2.3], [3.0, 1.0, 2.3], [0.0, 1.0, 2.3]]
    first = robot.cables[0]
    cables = [
        replace(first, name=f"C{k + 1}", exit_point=np.array(p)) for k, p in enumerate(corners)
    ]
    frame = replace(robot.frame, lower=np.array([0.0, -1.0, 0.0]), upper=np.array([3.0, 1.0, 2.3]))
    return replace(robot, motion="3T", axis=None, cables=cables, frame=frame)


CASES = {
    "a wall": ("gt_graffiti", [[1.0, 0.0, 1.0], [1.5, 0.0, 1.4], [1.2, 0.0, 0.8]], (0, 2)),
    "a board": ("maslow_4", [[2.0, 1.5, 0.0], [2.2, 1.7, 0.0], [2.4, 1.4, 0.0]], (0, 1)),
    "space": (in_space, [[1.5, 0.0, 1.0], [1.6, 0.2, 1.2], [1.3, 0.1, 0.9]], (0, 1, 2)),
}


def poses(places):
    return [RigidTransform(p) for p in places]


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """A plan, and the axes of W along which its platform moves."""
    robot, places, axes = CASES[request.param]
    robot = cdpr.load_robot(robot) if isinstance(robot, str) else robot()
    return cdpr.plan_path(robot, poses(places)), list(axes)


def test_tensions_of_a_plan_move_the_mass_as_newton_says(case):
    """Pulls along straight lines from the mass, or the ends of its level arms, to the exit points,
    and its weight: mass times acceleration along each axis that it can move."""
    run, axes = case
    robot, samples = run.robot, run.samples
    exits = np.array([cable.exit_point for cable in robot.cables])
    weight = np.array([0.0, 0.0, -robot.gravity]) * robot.platform.mass
    largest = float(np.max(samples.tensions))
    for k in np.linspace(0, len(samples.times) - 1, 25).astype(int):
        row = np.asarray(run.motion.motion(float(samples.times[k])))
        way = exits - row[4:7]
        across = np.linalg.norm(way[:, :2], axis=1, keepdims=True)
        if robot.pulley.arm > 0.0:
            way[:, :2] *= 1.0 - robot.pulley.arm / across
        units = way / np.linalg.norm(way, axis=1)[:, None]
        force = samples.tensions[k] @ units + weight
        np.testing.assert_allclose(
            force[axes], robot.platform.mass * row[16:19][axes], atol=NEWTON * largest
        )
        speeds = -units @ row[10:13]
        np.testing.assert_allclose(samples.cable_speeds[k], speeds, atol=1e-9)
    assert np.max(samples.uses) <= 1.005
    limits = robot.tension_limits(None)
    assert np.min(samples.tensions) >= limits[0]
    assert largest <= limits[1]


def test_blocks_and_tackles_turn_the_motor_further():
    robot, places, _ = CASES["a board"]
    robot = cdpr.load_robot(robot)
    tackled = replace(
        robot, cables=[replace(cable, mechanical_advantage=2.0) for cable in robot.cables]
    )
    plain, twice = (
        cable_stream(cdpr.plan_path(one, poses(places), cable_speed=0.05), 20.0)
        for one in (robot, tackled)
    )
    np.testing.assert_allclose(twice.motor_angles, 2.0 * plain.motor_angles, rtol=1e-12)


def test_the_command_streams_g_code_of_a_router(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(WRITES, undrawn)
    (tmp_path / "a.gcode").write_text(G_CODE)
    out = tmp_path / "out"
    args = ["maslow_4", "--path", str(tmp_path / "a.gcode"), "--stream", "20"]
    code, _, err = run_plan(capsys, *args, "--stations", "150", "--out", str(out))
    assert code == 0
    assert "not tracked: computed torque moves bodies alone" in err
    stream = json.loads((out / "stream.json").read_text())
    assert stream["keeps_taut"]
    rows = np.genfromtxt(out / "lengths.csv", delimiter=",", names=True)
    # The highest point of an arc about (2.15, 1.55) m through (2.1, 1.6) m.
    motion = np.genfromtxt(out / "motion.csv", delimiter=",", names=True)
    assert np.max(motion["y_m"]) == pytest.approx(1.55 + np.hypot(0.05, 0.05), abs=1e-3)
    assert rows["time_s"][-1] == pytest.approx(motion["time_s"][-1])


def test_what_computed_torque_cannot_track_is_refused_before_it_is_planned():
    robot, places, _ = CASES["a wall"]
    with pytest.raises(RobotFileError, match="accepted by computed torque, which tracking needs"):
        cdpr.plan_path(robot, [cdpr.Pose(position=np.array(p)) for p in places], track=True)


def test_a_plane_that_lies_along_no_axes_is_refused():
    robot = replace(cdpr.load_robot("gt_graffiti"), axis=np.array([0.0, 1.0, 0.5]))
    with pytest.raises(PlanningError, match=r"motion: found 2T, axis .*or 1T, 2T, 3T along axes"):
        cdpr.plan_path(robot, [[0.0, 0.0, 0.0]] * 2)
