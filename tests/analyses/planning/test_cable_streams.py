"""Plans as cable lengths and motor angles over time, and plans for point masses."""

import json
from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.planning.cable_streams import cable_stream
from cdpr_drake.cables.models import CATENARY, ELASTIC
from cdpr_drake.cables.states import cable_state
from cdpr_drake.errors import PlanningError, RobotFileError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.planning.path_task import sample_motion
from tests.analyses.planning.plan_command import run, table, undrawn

__all__ = ["undrawn"]

NEWTON = 1e-9
"""Share of the largest tension: sums of a few forces in doubles."""


def poses(*places):
    return [pose_from_angles(np.array(place), np.zeros(3)) for place in places]


@pytest.fixture(scope="module")
def plan():
    places = [0.0, 0.0, 0.4], [0.1, 0.1, 0.5], [-0.1, 0.1, 0.5]
    return cdpr.plan_path("acrobot_fully_constrained", poses(*places), limits=(5.0, 55.0))


@pytest.mark.parametrize("model", [ELASTIC, CATENARY])
def test_lengths_give_the_tensions_of_the_plan(plan, model):
    stream = cable_stream(plan, 100.0, model)
    tensions = sample_motion(plan.task, plan.motion, stream.times).tensions
    for time, l0, expected in zip(stream.times, stream.lengths, tensions, strict=True):
        state = cable_state(plan.task.cables, model, plan.motion.pose(float(time)), l0)
        np.testing.assert_allclose(state.tensions, expected, rtol=1e-6, atol=1e-6)


def test_motor_angles_are_lengths_over_drums(plan):
    stream = cable_stream(plan, 50.0)
    radius = plan.robot.winch.drum_radius + plan.robot.cable.diameter / 2.0
    paid_out = stream.lengths - stream.zero_lengths
    wound = stream.motor_angles * radius / plan.robot.winch.gear_ratio
    np.testing.assert_allclose(wound, paid_out, rtol=0.05, atol=1e-9)
    assert np.all(np.sign(stream.motor_angles) == np.sign(paid_out))
    assert np.all(stream.stretch > 0.0)


def test_a_stream_that_is_too_coarse_lets_cables_go_slack(plan):
    fine, coarse = cable_stream(plan, 1000.0), cable_stream(plan, 5.0)
    assert (fine.keeps_taut, coarse.keeps_taut) == (True, False)
    assert np.min(coarse.least) < np.min(fine.least)
    assert "CABLES GO SLACK" in repr(coarse)


@pytest.mark.parametrize("model", [ELASTIC, CATENARY])
def test_its_figure_has_what_drives_are_sent(plan, model):
    stream = cable_stream(plan, 50.0, model)
    panels = stream.plot().axes
    values = stream.lengths, stream.motor_angles / (2.0 * np.pi), 1e3 * stream.stretch
    for axes, columns in zip(panels, values, strict=True):
        curves = [line.get_ydata() for line in axes.lines]
        np.testing.assert_allclose(np.transpose(curves), columns)
        assert "[" in axes.get_ylabel()
    assert ("sag" in panels[2].get_ylabel()) == (model == CATENARY)
    assert len(panels[0].get_legend().get_texts()) == len(plan.robot.cables)


@pytest.mark.parametrize(("rate", "model", "refusal"), [
    (0.1, ELASTIC, "rate: found 0.1 Hz"), (50.0, "kelvin_voigt", "model: found 'kelvin_voigt'"),
])  # fmt: skip
def test_what_makes_no_stream_is_refused(plan, rate, model, refusal):
    with pytest.raises(PlanningError, match=refusal):
        cable_stream(plan, rate, model)


# Point masses in a plane and in space.


def in_space():
    """Four cables from above and one from below that hold a point mass."""
    robot = cdpr.load_robot("gt_graffiti")
    corners = [[1.5, 0.0, 0.0], [0.0, 0.0, 2.3], [3.0, -1.0, 2.3], [3.0, 1.0, 2.3], [0.0, 1.0, 2.3]]
    cables = [
        replace(robot.cables[0], name=f"C{k + 1}", exit_point=np.array(p))
        for k, p in enumerate(corners)
    ]
    frame = replace(robot.frame, lower=np.array([0.0, -1.0, 0.0]), upper=np.array([3.0, 1.0, 2.3]))
    return replace(robot, motion="3T", axis=None, cables=cables, frame=frame)


WALL = [[1.0, 0.0, 1.0], [1.5, 0.0, 1.4], [1.2, 0.0, 0.8]]
BOARD = [[2.0, 1.5, 0.0], [2.2, 1.7, 0.0], [2.4, 1.4, 0.0]]
CASES = {
    "a wall": (lambda: cdpr.load_robot("gt_graffiti"), WALL, [0, 2]),
    "a board": (lambda: cdpr.load_robot("maslow_4"), BOARD, [0, 1]),
    "space": (in_space, [[1.5, 0.0, 1.0], [1.6, 0.2, 1.2], [1.3, 0.1, 0.9]], [0, 1, 2]),
}
"""Robots, places of a path, and the axes of W along which the platform moves."""


@pytest.mark.parametrize("name", CASES)
def test_tensions_of_a_plan_move_the_mass_as_newton_says(name):
    """Pulls along straight lines from the mass, or the ends of its level arms, to the exit points,
    and its weight: mass times acceleration along each axis that it can move."""
    make, places, axes = CASES[name]
    plan = cdpr.plan_path(make(), poses(*places))
    robot, samples, mass = plan.robot, plan.samples, plan.robot.platform.mass
    exits = np.array([cable.exit_point for cable in robot.cables])
    weight = np.array([0.0, 0.0, -robot.gravity]) * mass
    largest = float(np.max(samples.tensions))
    for k in np.linspace(0, len(samples.times) - 1, 25).astype(int):
        row = np.asarray(plan.motion.motion(float(samples.times[k])))
        way = exits - row[4:7]
        across = np.linalg.norm(way[:, :2], axis=1, keepdims=True)
        if robot.pulley.arm > 0.0:
            way[:, :2] *= 1.0 - robot.pulley.arm / across
        units = way / np.linalg.norm(way, axis=1)[:, None]
        force = samples.tensions[k] @ units + weight
        np.testing.assert_allclose(force[axes], mass * row[16:19][axes], atol=NEWTON * largest)
        np.testing.assert_allclose(samples.cable_speeds[k], -units @ row[10:13], atol=1e-9)
    assert np.max(samples.uses) <= 1.005
    lower, upper = robot.tension_limits(None)
    assert lower <= np.min(samples.tensions) <= largest <= upper


def test_blocks_and_tackles_turn_the_motor_further():
    robot = cdpr.load_robot("maslow_4")
    cables = [replace(cable, mechanical_advantage=2.0) for cable in robot.cables]
    plain, twice = (
        cable_stream(cdpr.plan_path(each, poses(*BOARD), cable_speed=0.05), 20.0).motor_angles
        for each in (robot, replace(robot, cables=cables))
    )
    np.testing.assert_allclose(twice, 2.0 * plain, rtol=1e-12)


@pytest.mark.usefixtures("undrawn")
def test_the_command_streams_g_code_of_a_router(tmp_path, capsys):
    """Lines and an arc on Maslow's board [mm], 50 mm/s."""
    code, out = tmp_path / "a.gcode", tmp_path / "out"
    code.write_text("G0 X2000 Y1500\nG1 X2100 Y1600 F3000\nG2 X2200 Y1500 I50 J-50\nG1 X2000\n")
    words = ["--path", str(code), "--stream", "20", "--stations", "150", "--out", str(out)]
    code, _, err = run(capsys, "maslow_4", *words)
    assert code == 0
    assert "not tracked: computed torque moves bodies alone" in err
    assert json.loads((out / "stream.json").read_text())["keeps_taut"]
    # The highest point of an arc about (2.15, 1.55) m through (2.1, 1.6) m.
    motion = table(out)
    assert np.max(motion["y_m"]) == pytest.approx(1.55 + np.hypot(0.05, 0.05), abs=1e-3)
    assert table(out, "lengths.csv")["time_s"][-1] == pytest.approx(motion["time_s"][-1])


def test_what_computed_torque_cannot_track_is_refused_before_it_is_planned():
    with pytest.raises(RobotFileError, match="accepted by computed torque, which tracking needs"):
        cdpr.plan_path("gt_graffiti", poses(*WALL), track=True)


def test_a_plane_that_lies_along_no_axes_is_refused():
    robot = replace(cdpr.load_robot("gt_graffiti"), axis=np.array([0.0, 1.0, 0.5]))
    with pytest.raises(PlanningError, match=r"motion: found 2T, axis .*or 1T, 2T, 3T along axes"):
        cdpr.plan_path(robot, poses([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]))
