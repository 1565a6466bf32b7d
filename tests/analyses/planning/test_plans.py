"""Plans along a path: on the simulated robot, by the command, and what commands refuse."""

import json
import re

import numpy as np
import pytest

from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from tests.analyses.planning.plan_command import drawn, planned, run, summary, table


def test_the_simulated_robot_keeps_the_limits():
    robot = load_robot("acrobot_large")
    limits = robot_limits(robot, (1.0, 60.0))
    places = np.array([[0, 0, 0.2], [0.15, -0.1, 0.4], [-0.1, 0.1, 0.3]])
    poses = [pose_from_angles(place, np.zeros(3)) for place in places]
    task = path_task(robot, limits, reserve=RESERVE)
    plan = plan_along_path(task, make_path(robot, poses, "blend"))
    tracked = track_plan(robot, plan, limits)
    assert tracked.keeps_limits()
    assert tracked.missed_steps() == 0
    assert tracked.errors()[0] < 2e-3  # a step of control late at every switch
    np.testing.assert_allclose(tracked.log["X_WP"][-1, 4:], places[-1], atol=1e-3)
    without = track_plan(robot, plan, task.limits)  # no reserve: feedback misses some
    assert without.missed_steps() > 0
    assert not without.keeps_limits()


def test_the_torque_that_friction_leaves_is_what_a_plan_may_use():
    robot = load_robot("caroca")
    limits = robot_limits(robot)
    viscous = 2e-3 * robot.winch.rated_cable_speed() / limits.ratio
    assert limits.torque == pytest.approx(15.34 - 0.2 - viscous)
    assert np.isinf(robot_limits(load_robot("planar")).torque)


def test_robots_whose_winches_or_pulleys_are_not_known_to_plans_are_refused():
    shared = load_robot("planar")
    shared.cables[0].winch = shared.cables[1].winch = "one"
    with pytest.raises(PlanningError, match="several cables on a winch"):
        path_task(shared)
    robot = load_robot("acrobot_large")
    axes = np.tile([[0.0], [0.0], [1.0]], (1, 8))
    with pytest.raises(PlanningError, match="pulleys at the platform"):
        path_task(robot, cables=robot.cable_set().over_platform_pulleys(0.01, axes))


def test_the_command_plans_and_writes(tmp_path, capsys):
    folder = tmp_path / "out"
    code, out, _ = run(
        capsys, "planar", "--waypoints", "-0.1,0.1,0.3; 0.15,-0.1,0.3,0,0,10; 0.2,0.1,0.3",
        "--stations", "150", "--out", str(folder), "--json",
    )  # fmt: skip
    answer = json.loads(out)
    assert (code, answer) == (0, summary(folder))
    assert answer["tracked"]["keeps_limits"]
    rows = table(folder)
    assert rows["time_s"][-1] == pytest.approx(answer["duration_s"], abs=1e-3)
    assert np.max(rows["tension_C1_n"]) <= 60.0
    assert drawn(folder, "phase_plane", "tensions", "winches", "path")


def test_the_command_plans_a_motion_that_resists(tmp_path, capsys):
    wrenches, folder = tmp_path / "push.yaml", tmp_path / "out"
    wrenches.write_text("box: [0, 0, 0.2, 10, 6, 0]\n")
    words = ["planar", "--waypoints", "-0.1,0.1,0.3;0.2,0.1,0.3", "--stations", "100", "--no-track"]
    _, out, _ = run(capsys, *words, "--resist", str(wrenches), "--out", str(folder))
    assert "resists 8 wrenches" in out
    answer = summary(folder)
    resisted = answer["resist"]
    margins = [corner["least_margin"] for corner in resisted["corners"]]
    pushes = np.abs([corner["wrench_n_m_n"] for corner in resisted["corners"]])
    np.testing.assert_array_equal(pushes, [[0, 0, 0.2, 10, 6, 0]] * 8)
    assert resisted["worst"]["least_margin"] == pytest.approx(min(margins))
    assert -1e-6 < min(margins) < 0.3
    assert "deg" in resisted["worst"]["pose"]
    assert resisted["largest_share_between_stations"] < 1.002
    assert answer["arguments"]["resist"] == str(wrenches)
    assert drawn(folder, "resistance")
    without = planned(tmp_path / "without", *words)
    assert "resist" not in without
    assert not (tmp_path / "without" / "resistance.png").exists()
    assert without["duration_s"] < answer["duration_s"]
    wrenches.write_text("ellipsoid: [0, 0, 0, 1, 1, 0]\n")
    code, _, err = run(capsys, *words, "--resist", str(wrenches))
    assert (code, f"{wrenches}: ellipsoid: found one" in err.replace("\n", "")) == (2, True)


NEAR = "planar --waypoints 0,0,0.3;0.1,0,0.3"
FREE = "planar --free --from=-0.15,0,0.3"
TO = "--to=0.15,0,0.3"
PROVEN = "acrobot_small --proven --from=-0.15,0,0.25"
LOW = f"{PROVEN} --to=0.15,0,0.25"

REFUSALS = [
    ("planar", "--path: found nothing; accepted: a value"),
    ("planar --waypoints 0,0,0.3", "--waypoints: found '0,0,0.3'; accepted: at least two poses"),
    ("planar --waypoints 0,0,0.3;0,x,0.3", "--waypoints: found .*0,x,0.3'"),
    ("planar --waypoints 0,0,0.3;0.1,0,0.35", "path: 2 of 2 poses: pose: found .* cannot have"),
    ("planar --waypoints 0,0,0.3;9,0,0.3", "outside the frame"),
    (f"{NEAR} --reserve 0.6", "reserve: found 0.6"),
    (f"{NEAR} --tolerance 0", "tolerance: found 0"),
    (f"{NEAR} --speed -1", "speed: found -1"),
    ("planar --waypoints 0,0,0.3;0,0,0.3", "poses 1 and 2 are the same"),
    ("acrobot_large --waypoints 0,0,.2;.4,.4,1 --limits 5,20", r"at s = .*pose .*C\d"),
    # Free motions.
    (f"{FREE} {TO} --waypoints 0,0,1;0,0,2", "--waypoints: found with --free; accepted"),
    (FREE, "--to: found nothing"),
    (f"planar --free --from=0,0 {TO}", "--from: found '0,0'"),
    (f"{NEAR} --from=-0.15,0,0.3 {TO}", "--from: found without --free and"),
    (f"{FREE} {TO} --least tension", "duration: found none with the least tension"),
    (f"{FREE} {TO} --duration 1", "duration: found one with the least time"),
    (f"{FREE} {TO} --least energy --duration 0.01", "duration: found 0.01 s; accepted: 0.05 to"),
    (f"{FREE} {TO} --clearance -1", "clearance: found -1"),
    (f"{FREE} {TO} --obstacles box.yaml", "clearance: found none for the obstacles"),
    (f"{FREE} {TO} --knots 2", "knots: found 2"),
    (f"{FREE} {TO} --camera x", "--camera: found without --keep-in-view"),
    (f"{FREE} {TO} --keep-in-view 0,0", "--keep-in-view: found '0,0'"),
    (f"{FREE} {TO} --keep-in-view 0,0,0 --camera x", "camera: found .x.; accepted for planar"),
    (f"{FREE} {TO} --keep-in-view 0,0,0 --nearest 0", "nearest: found 0 m"),
    (f"{FREE} --to=-0.15,0,0.3", "to: found the pose of the start"),
    (f"{FREE} --to=0.2,0.1,0.4", "to: pose: found .* cannot have"),
    (f"{FREE} {TO} --obstacles no.yaml", "no.yaml: there is no such file"),
    (f"{FREE} {TO} --limits 50,60", r"from: pose .* C\d .* accepted: 5"),
    (f"{FREE} {TO} --guess none.csv", "none.csv: there is no such file of a motion"),
    ("acrobot_large --free --from=0,0,0.35 --to=0.2,0,0.35 --clearance 0.005 --obstacles box.yaml",
     "from: found .* m of the platform and box 1"),
    (f"{FREE} {TO} --least energy --duration 0.06 --knots 6",
     r"of the way, at .*; cables at a limit .*: C\d"),
    # Proven motions.
    (f"{LOW} --free", "--free: found with --proven; accepted: one of them"),
    (f"{LOW} --knots 5", "--knots: found with --proven; accepted: with --free"),
    ("acrobot_small --time --waypoints 0,0,1;0,0,2", "--time: found without --free and"),
    (f"{LOW} --acceleration -1", "--acceleration: found '-1'"),
    (f"{LOW} --acceleration 1,2,3,4", "--acceleration: found '1,2,3,4'"),
    (f"{LOW} --boxes 0", "--boxes: found 0"),
    (f"{LOW} --obstacles none.yaml", "none.yaml: there is no such file"),
    (f"{PROVEN} --to=0.5,0,0.2 --boxes 500",
     "to: found the pose 0.5,0,0.2,0,0,0: wrench-feasible fails: capac"),
    ("acrobot_small --proven --from=0.5,0,0.2 --to=0.15,0,0.25 --boxes 500",
     "from: found the pose 0.5"),
    (f"{LOW},0,0,9 --acceleration 1", "--acceleration: found with a range of angles"),
    # Among what moves.
    (f"{LOW},0,0,1 --obstacles moving.yaml", "from, to: found two orientations"),
    (f"{LOW} --obstacles moving.yaml --method gcs", "--method: found 'gcs'"),
    (f"{LOW} --obstacles moving.yaml --acceleration 0", "--acceleration: found 0"),
]  # fmt: skip

BOX = "{pose: {position: [0, 0, 0.35]}, size: [0.02, 0.02, 0.02]%s}"


@pytest.mark.parametrize(("words", "refusal"), REFUSALS)
def test_bad_input_is_one_line_and_writes_nothing(tmp_path, monkeypatch, capsys, words, refusal):
    monkeypatch.chdir(tmp_path)
    for name, motion in (("box", ""), ("moving", ", motion: {velocity: [1, 0, 0]}")):
        (tmp_path / f"{name}.yaml").write_text(f"boxes: [{BOX % motion}]\n")
    files = set(tmp_path.iterdir())
    code, _, err = run(capsys, *words.split())
    assert code == 2
    assert re.search(refusal, err), err
    assert len(err.strip().splitlines()) == 1
    assert set(tmp_path.iterdir()) == files
