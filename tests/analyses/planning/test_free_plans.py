"""Free motions from the command line, and scenarios that track what was planned."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.free_motion import FreeSettings, solve_free_motion
from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.errors import PlanningError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.trajectories.sampled_motion import read_motion
from tests.analyses.planning.plan_command import drawn
from tests.analyses.planning.plan_command import planned as written

LARGE = ["--from=-0.1,0,0.35", "--to=0.1,0,0.35"]
KNOTS = 6
BETWEEN = 0.05  # of a limit: between knots a motion keeps it about, and reserve covers that
BOX = "boxes: [{pose: {position: [0, 0, 0.2]}, size: [0.02, 0.02, 0.02]}]\n"
MARK = "-0.063,0,0.02"


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The least time of a large platform, off an obstacle, its camera on a mark."""
    folder = tmp_path_factory.mktemp("free")
    (folder / "box.yaml").write_text(BOX)
    written(
        folder / "out", "acrobot_large", "--free", *LARGE, "--knots", "6", "--clearance", "0.005",
        "--obstacles", str(folder / "box.yaml"), "--keep-in-view", MARK, "--camera", "onboard",
        "--limits", "1,60", "--no-pulleys",
    )  # fmt: skip
    return folder / "out"


def test_the_command_writes_a_free_motion_that_the_simulated_robot_keeps(planned):
    told = json.loads((planned / "summary.json").read_text())
    assert told["tracked"]["keeps_limits"]
    assert told["keeps_distances_and_view"]
    assert min(told["least_distances_m"].values()) > 0.005
    assert 0.0 < told["least_share_of_view"]["point 1"] < 1.0
    assert told["arguments"]["least"] is None
    assert told["largest_share_of_limits"] < 1.0 + BETWEEN
    table = np.genfromtxt(planned / "motion.csv", delimiter=",", names=True)
    assert table["time_s"][-1] == pytest.approx(told["duration_s"], abs=1e-12)
    assert table["x_m"][-1] == pytest.approx(0.1, abs=1e-6)
    motion = read_motion(planned / "motion.csv")
    np.testing.assert_allclose(motion.poses[0].translation(), [-0.1, 0.0, 0.35], atol=1e-9)
    assert drawn(planned, "limits", "tensions", "winches", "path", "distances")


def scenario_of(file, *more):
    return load_scenario(
        "acrobot_computed_torque",
        [
            f"trajectory.file={file}", "trajectory.pause=0.02", "duration=0.6", "log_rate=1000",
            "integration.engine=compiled", "distribution.method=quadratic_program", *more,
        ],
    )  # fmt: skip


def test_planned_limits_hold_in_the_run_of_a_scenario(planned, tmp_path):
    robot = load_robot("acrobot_large")
    limits = robot_limits(robot, LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE))
    scenario = scenario_of(planned / "motion.csv")
    result = run_tension_scenario(scenario)
    log = result.log
    assert log["failures"][-1, 0] == 0
    assert np.min(log["tensions"][1:]) >= limits.lower - 1e-9
    assert np.max(log["tensions"][1:]) <= limits.upper + 1e-9
    speeds = np.diff(log["lengths"], axis=0) * 1000.0
    assert 0.3 < np.max(np.abs(speeds)) / limits.cable_speed < 1.0  # it moves, and keeps it
    np.testing.assert_allclose(log["X_WP"][-1, 4:], [0.1, 0.0, 0.35], atol=1e-3)
    told = json.loads((planned / "summary.json").read_text())["tracked"]
    used = float(np.max(np.abs(speeds)) / limits.cable_speed)
    assert used == pytest.approx(told["largest_share_of_limits"]["cable speed"], rel=1e-3)
    write_run_inputs(tmp_path, scenario, robot)
    again = load_scenario(str(tmp_path / "scenario.yaml"))  # repeats from its folder alone
    assert again.trajectory.file == str(tmp_path / "motion.csv")
    one, other = (s.trajectory.trajectory().motion(0.1) for s in (scenario, again))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["trajectory.file=none.csv"], "trajectory.file: .*none.csv: there is no such file"),
        (["robot=planar"], "trajectory.file: .*: at 0.02 s: .* cannot have"),
        (["duration=0.01"], "duration: found 0.01 s; accepted: longer than 0.02 s"),
        (["trajectory.file=null", "trajectory.start=null"], "trajectory.start: found none"),
    ],
)
def test_files_that_a_scenario_cannot_track_are_named(planned, changes, said):
    with pytest.raises(ScenarioError, match=said):
        scenario_of(planned / "motion.csv", *changes)


@pytest.fixture(scope="module")
def task():
    robot = load_robot("planar")
    given = LimitSettings(cable_acceleration=4.0, speed=0.5, reserve=RESERVE)
    return robot, path_task(robot, given), robot_limits(robot, given)


def asked(**more):
    ends = {"start": RigidTransform([-0.15, 0.0, 0.3]), "goal": RigidTransform([0.15, 0.0, 0.3])}
    return FreeSettings(**ends, knots=KNOTS, **more)


def test_limits_of_winches_and_speed_are_kept(task):
    robot, planar, limits = task
    found = solve_free_motion(robot, planar, asked())
    samples = found.samples()
    assert np.max(samples.uses) < 1.0 + BETWEEN
    assert np.max(samples.uses[:, 2]) > 0.95  # what the least time rests on
    assert track_plan(robot, found, limits).keeps_limits()


def test_least_tension_and_least_energy_differ_in_the_time_that_they_take(task):
    robot, planar, _ = task
    energy = solve_free_motion(robot, planar, asked(least="energy"))
    given = solve_free_motion(robot, planar, asked(least="energy", duration=2.0 * energy.duration))
    tension = solve_free_motion(robot, planar, asked(least="tension", duration=1.5))

    def heat(one):
        return float(np.mean(one.tensions**2)) * one.duration

    assert heat(energy) < heat(given)
    assert tension.duration == pytest.approx(1.5)
    assert np.mean(tension.tensions**2) < np.mean(energy.tensions**2)


def test_what_no_motion_can_do_names_place_and_cable(task):
    robot, planar, _ = task
    with pytest.raises(PlanningError, match=r"of the way, at .*; cables at a limit .*: C\d"):
        solve_free_motion(robot, planar, asked(least="energy", duration=0.06))
