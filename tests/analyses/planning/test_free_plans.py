"""Free motions from the command line, and scenarios that track what was planned."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.free_motion import solve_free_motion
from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import RESERVE, path_task, robot_limits
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.trajectories.sampled_motion import read_motion
from tests.analyses.planning.plan_command import drawn, planned, summary, table

BETWEEN = 0.05  # of a limit: between knots a motion keeps it about, and reserve covers that


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The least time of a large platform, off an obstacle, its camera on a mark."""
    files = tmp_path_factory.mktemp("free")
    box = files / "box.yaml"
    box.write_text("boxes: [{pose: {position: [0, 0, 0.2]}, size: [0.02, 0.02, 0.02]}]\n")
    planned(
        files / "out", "acrobot_large", "--free", "--from=-0.1,0,0.35", "--to=0.1,0,0.35",
        "--knots", "6", "--clearance", "0.005", "--obstacles", str(box), "--keep-in-view",
        "-0.063,0,0.02", "--camera", "onboard", "--limits", "1,60", "--no-pulleys",
    )  # fmt: skip
    return files / "out"


def test_the_command_writes_a_free_motion_that_the_simulated_robot_keeps(folder):
    answer = summary(folder)
    assert answer["tracked"]["keeps_limits"]
    assert answer["keeps_distances_and_view"]
    assert min(answer["least_distances_m"].values()) > 0.005
    assert 0.0 < answer["least_share_of_view"]["point 1"] < 1.0
    assert answer["arguments"]["least"] is None
    assert answer["largest_share_of_limits"] < 1.0 + BETWEEN
    last = table(folder)[-1]
    assert last["time_s"] == pytest.approx(answer["duration_s"], abs=1e-12)
    assert last["x_m"] == pytest.approx(0.1, abs=1e-6)
    start = read_motion(folder / "motion.csv").poses[0].translation()
    np.testing.assert_allclose(start, [-0.1, 0.0, 0.35], atol=1e-9)
    assert drawn(folder, "limits", "tensions", "winches", "path", "distances")


def scenario_of(folder, *more):
    return load_scenario(
        "acrobot_computed_torque",
        [
            f"trajectory.file={folder / 'motion.csv'}", "trajectory.pause=0.02", "duration=0.6",
            "log_rate=1000", "integration.engine=compiled",
            "distribution.method=quadratic_program", *more,
        ],
    )  # fmt: skip


def test_planned_limits_hold_in_the_run_of_a_scenario(folder, tmp_path):
    robot, scenario = load_robot("acrobot_large"), scenario_of(folder)
    limits = robot_limits(robot, (1.0, 60.0))
    log = TensionRun(scenario).simulate().log
    assert log["failures"][-1, 0] == 0
    assert np.min(log["tensions"][1:]) >= limits.lower - 1e-9
    assert np.max(log["tensions"][1:]) <= limits.upper + 1e-9
    speeds = np.diff(log["lengths"], axis=0) * 1000.0
    used = float(np.max(np.abs(speeds)) / limits.cable_speed)
    assert 0.3 < used < 1.0  # it moves, and keeps it
    np.testing.assert_allclose(log["X_WP"][-1, 4:], [0.1, 0.0, 0.35], atol=1e-3)
    shares = summary(folder)["tracked"]["largest_share_of_limits"]
    assert used == pytest.approx(shares["cable speed"], rel=1e-3)
    write_run_inputs(tmp_path, scenario, robot)
    again = load_scenario(str(tmp_path / "scenario.yaml"))  # repeats from its folder alone
    assert again.trajectory.file == str(tmp_path / "motion.csv")
    rows = (each.trajectory.trajectory().motion(0.1) for each in (scenario, again))
    np.testing.assert_array_equal(*rows)


@pytest.mark.parametrize(
    ("changes", "refusal"),
    [
        (["trajectory.file=none.csv"], "trajectory.file: .*none.csv: there is no such file"),
        (["robot=planar"], "trajectory.file: .*: at 0.02 s: .* cannot have"),
        (["duration=0.01"], "duration: found 0.01 s; accepted: longer than 0.02 s"),
        (["trajectory.file=null", "trajectory.start=null"], "trajectory.start: found none"),
    ],
)
def test_files_that_a_scenario_cannot_track_are_named(folder, changes, refusal):
    with pytest.raises(ScenarioError, match=refusal):
        scenario_of(folder, *changes)


def solved(**more):
    """A motion of the planar robot, and its limits."""
    robot = load_robot("planar")
    limits = robot_limits(robot, cable_acceleration=4.0, speed=0.5)
    task = path_task(robot, limits, reserve=RESERVE)
    ends = RigidTransform([-0.15, 0.0, 0.3]), RigidTransform([0.15, 0.0, 0.3])
    return robot, limits, solve_free_motion(robot, task, *ends, knots=6, **more)


def test_limits_of_winches_and_speed_are_kept():
    robot, limits, solution = solved()
    uses = solution.samples().uses
    assert np.max(uses) < 1.0 + BETWEEN
    assert np.max(uses[:, 2]) > 0.95  # what the least time rests on
    assert track_plan(robot, solution, limits).keeps_limits()


def test_least_tension_and_least_energy_differ_in_the_time_that_they_take():
    energy = solved(least="energy")[2]
    slow = solved(least="energy", duration=2.0 * energy.duration)[2]
    tension = solved(least="tension", duration=1.5)[2]
    heats = [float(np.mean(each.tensions**2)) * each.duration for each in (energy, slow)]
    assert heats[0] < heats[1]
    assert tension.duration == pytest.approx(1.5)
    assert np.mean(tension.tensions**2) < np.mean(energy.tensions**2)
