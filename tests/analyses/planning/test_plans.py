"""Paths from files, plans on the simulated robot, and the command that does both."""

import json
import re

import numpy as np
import pytest

from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.planning.plan_tracking import track_plan
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.errors import CdprError, DataFileError, PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from tests.analyses.planning.plan_command import drawn, planned, run

G_CODE = """%
(a square) G21 G90
G0 X0 Y0 Z300 ; begin
N20 G1 X100 F1200
Y100 A2.5
G91 X-100
G20 G90 X0 Y0 Z11.811024
M30
"""


def write(path, words):
    path.write_text(words)
    return path


def test_a_table_of_poses(tmp_path):
    found = read_path(
        write(tmp_path / "a.csv", "# mine\nx,y,z,phi,theta,psi\n0,0,1,0,0,0\n1,2,3,0,0,90\n")
    )
    np.testing.assert_allclose(found.poses[1].translation(), [1, 2, 3])
    np.testing.assert_allclose(
        found.poses[1].rotation().matrix()[:2, :2], [[0, -1], [1, 0]], atol=1e-12
    )
    assert len(read_path(write(tmp_path / "b.csv", "0,0,1\n\n0,0,2\n0,1,2\n")).poses) == 3


def test_g_code(tmp_path):
    found = read_path(write(tmp_path / "a.nc", G_CODE))
    places = [np.round(X.translation(), 6).tolist() for X in found.poses]
    assert places == [[0, 0, 0.3], [0.1, 0, 0.3], [0.1, 0.1, 0.3], [0, 0.1, 0.3], [0, 0, 0.3]]
    assert found.poses[2].rotation().matrix()[2, 1] == pytest.approx(np.sin(np.radians(2.5)))
    assert found.remarks == ("M30 (end of program) left out: 1",)
    assert found.moves[1].speed == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("a.csv", "x,y\n1,2\n", "line 1: found the columns x, y"),
        ("a.csv", "0,0,1\n0,0\n", "line 2: .* accepted: 3 finite"),
        ("a.csv", "0,0,1\n0,nan,1\n", "line 2"),
        ("a.csv", "0,0,1\n", "found 1 poses"),
        ("a.nc", "G0 X0 Y0 Z0\nG5 X1 Y1 I1\n", "line 2: found G5; accepted: straight"),
        ("a.nc", "G0 X0 Y0\n", "line 1: Z is not known"),
        ("a.nc", "X0 Y0\n", "line 1: found coordinates before"),
        ("a.nc", "G0 X0 X1\n", "X twice"),
        ("a.nc", "G0 !\n", "found '!'"),
        ("a.nc", "G0 X1 Q3\n", "the word Q3"),
        ("a.txt", "", "accepted: .csv, .gcode"),
    ],
)
def test_wrong_files_are_named_with_their_line(tmp_path, name, words, said):
    with pytest.raises(DataFileError, match=said) as caught:
        read_path(write(tmp_path / name, words))
    assert isinstance(caught.value, CdprError)


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataFileError, match="cannot be read as text"):
        read_path(tmp_path / "a.csv")
    with pytest.raises(DataFileError, match="no such file"):
        read_path(tmp_path / "b.csv")


def test_the_simulated_robot_keeps_the_limits(tmp_path):
    robot = load_robot("acrobot_large")
    given = LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE)
    poses = read_path(write(tmp_path / "p.csv", "0,0,0.2\n0.15,-0.1,0.4\n-0.1,0.1,0.3\n")).poses
    plan = plan_along_path(path_task(robot, given), make_path(robot, poses, "blend"))
    tracked = track_plan(robot, plan, robot_limits(robot, given))
    assert tracked.keeps_limits()
    assert tracked.missed_steps() == 0
    assert tracked.errors()[0] < 2e-3  # a step of control late at every switch
    final = tracked.log["X_WP"][-1, 4:]
    np.testing.assert_allclose(final, [-0.1, 0.1, 0.3], atol=1e-3)
    without = track_plan(robot, plan, plan.task.limits)  # no reserve: feedback misses some
    assert without.missed_steps() > 0
    assert not without.keeps_limits()


def test_the_torque_that_friction_leaves_is_what_a_plan_may_use():
    robot = load_robot("caroca")
    limits = robot_limits(robot, LimitSettings(reserve=RESERVE))
    viscous = 2e-3 * robot.winch.rated_cable_speed() / limits.ratio
    assert limits.torque == pytest.approx(15.34 - 0.2 - viscous)
    assert np.isinf(robot_limits(load_robot("planar"), LimitSettings(reserve=RESERVE)).torque)


def test_robots_whose_winches_or_pulleys_are_not_known_to_plans_are_refused():
    shared = load_robot("planar")
    shared.cables[0].winch = shared.cables[1].winch = "one"
    with pytest.raises(PlanningError, match="several cables on a winch"):
        path_task(shared, LimitSettings(reserve=RESERVE))
    robot = load_robot("acrobot_large")
    axes = np.tile([[0.0], [0.0], [1.0]], (1, 8))
    pulleys = robot.cable_set().over_platform_pulleys(0.01, axes)
    with pytest.raises(PlanningError, match="pulleys at the platform"):
        path_task(robot, LimitSettings(reserve=RESERVE), pulleys)


def test_the_command_plans_and_writes(tmp_path, capsys):
    folder = tmp_path / "out"
    code, out, _ = run(
        capsys, "planar", "--waypoints", "-0.1,0.1,0.3; 0.15,-0.1,0.3,0,0,10; 0.2,0.1,0.3",
        "--stations", "150", "--out", str(folder), "--json",
    )  # fmt: skip
    assert code == 0
    told = json.loads(out)
    assert told == json.loads((folder / "summary.json").read_text())
    assert told["tracked"]["keeps_limits"]
    table = np.genfromtxt(folder / "motion.csv", delimiter=",", names=True)
    assert table["time_s"][-1] == pytest.approx(told["duration_s"], abs=1e-3)
    assert np.max(table["tension_C1_n"]) <= 60.0
    assert drawn(folder, "phase_plane", "tensions", "winches", "path")


def test_the_command_plans_a_motion_that_resists(tmp_path, capsys):
    wrenches = write(tmp_path / "push.yaml", "box: [0, 0, 0.2, 10, 6, 0]\n")
    words = ["planar", "--waypoints", "-0.1,0.1,0.3;0.2,0.1,0.3", "--stations", "100", "--no-track"]
    folder = tmp_path / "out"
    _, out, _ = run(capsys, *words, "--resist", str(wrenches), "--out", str(folder))
    assert "resists 8 wrenches" in out
    told = json.loads((folder / "summary.json").read_text())
    resisted = told["resist"]
    assert len(resisted["corners"]) == 8
    assert resisted["worst"]["least_margin"] == pytest.approx(
        min(corner["least_margin"] for corner in resisted["corners"])
    )
    assert -1e-6 < resisted["worst"]["least_margin"] < 0.3
    assert "deg" in resisted["worst"]["pose"]
    assert resisted["largest_share_between_stations"] < 1.002
    assert told["arguments"]["resist"] == str(wrenches)
    assert drawn(folder, "resistance")
    without = planned(tmp_path / "without", *words)
    assert "resist" not in without
    assert not (tmp_path / "without" / "resistance.png").exists()
    assert without["duration_s"] < told["duration_s"]
    round_set = write(tmp_path / "round.yaml", "ellipsoid: [0, 0, 0, 1, 1, 0]\n")
    code, _, err = run(capsys, *words, "--resist", str(round_set))
    assert code == 2
    assert f"{round_set}: ellipsoid: found one" in err.replace("\n", "")
    free = ("planar", "--free", "--from=0,0,.3", "--to=0.1,0,.3")
    code, _, err = run(capsys, *free, "--resist", str(round_set))
    assert (code, "--resist: found with --free" in err) == (2, True)


NEAR = "--waypoints 0,0,0.3;0.1,0,0.3"
FROM, TO = "--from=-0.15,0,0.3", "--to=0.15,0,0.3"
PROVEN, LOW = "acrobot_small --proven", "--from=-0.15,0,0.25 --to=0.15,0,0.25"

REFUSALS = [
    ("planar", "--path: found none without --free"),
    ("planar --waypoints 0,0,0.3", "--waypoints: found '0,0,0.3'; accepted: at least two poses"),
    ("planar --waypoints 0,0,0.3;0,x,0.3", "--waypoints: found .*0,x,0.3'"),
    ("planar --waypoints 0,0,0.3;0.1,0,0.35", "path: 2 of 2 poses: pose: found .* cannot have"),
    ("planar --waypoints 0,0,0.3;9,0,0.3", "outside the frame"),
    (f"planar {NEAR} --reserve 0.6", "reserve: found 0.6"),
    (f"planar {NEAR} --tolerance 0", "tolerance: found 0"),
    (f"planar {NEAR} --speed -1", "speed: found -1"),
    ("planar --waypoints 0,0,0.3;0,0,0.3", "poses 1 and 2 are the same"),
    ("acrobot_large --waypoints 0,0,.2;.4,.4,1 --limits 5,20", r"at s = .*pose .*C\d"),
    # Free motions.
    (f"planar --free {FROM} {TO} --waypoints 0,0,1;0,0,2", "--path: found with --free; accepted"),
    (f"planar --free {FROM}", "--to: found none with --free"),
    (f"planar --free --from=0,0 {TO}", "--from: found '0,0'"),
    (f"planar {FROM} {TO} {NEAR}", "--from: found without --free and"),
    (f"planar --free {FROM} {TO} --least work", "--least: found 'work'; accepted: time, tension"),
    (f"planar --free {FROM} {TO} --least tension", "duration: found none with the least tension"),
    (f"planar --free {FROM} {TO} --duration 1", "duration: found one with the least time"),
    (f"planar --free {FROM} {TO} --clearance -1", "clearance: found -1"),
    (f"planar --free {FROM} {TO} --knots 2", "knots: found 2"),
    (f"planar --free {FROM} {TO} --camera x", "--camera: found without --keep-in-view"),
    (f"planar --free {FROM} {TO} --keep-in-view 0,0", "--keep-in-view: found '0,0'"),
    (f"planar --free {FROM} --to=-0.15,0,0.3", "to: found the pose of the start"),
    (f"planar --free {FROM} --to=0.2,0.1,0.4", "to: pose: found .* cannot have"),
    (f"planar --free {FROM} {TO} --obstacles no.yaml", "no.yaml: there is no such file"),
    (f"planar --free {FROM} {TO} --limits 50,60", r"from: pose .* C\d .* accepted: 5"),
    (f"planar --free {FROM} {TO} --method gcs", "--method: found with --free; accepted"),
    (f"planar --free {FROM} {TO} --guess none.csv", "none.csv: there is no such file of a motion"),
    # Proven motions.
    (f"{PROVEN} --from=-0.15,0,0.25", "--to: found none with --proven"),
    (f"{PROVEN} {LOW} --free", "--free: found with --proven; accepted: one of them"),
    (f"{PROVEN} {LOW} --knots 5", "--knots: found with --proven; accepted: with --free"),
    (f"{PROVEN} {LOW} --waypoints 0,0,1;0,0,2", "--path: found with --proven"),
    ("acrobot_small --time --waypoints 0,0,1;0,0,2", "--time: found without --free and"),
    (f"{PROVEN} {LOW} --acceleration -1", "--acceleration: found '-1'"),
    (f"{PROVEN} {LOW} --acceleration 1,2,3,4", "--acceleration: found '1,2,3,4'"),
    (f"{PROVEN} {LOW} --boxes 0", "--boxes: found 0"),
    (f"{PROVEN} {LOW} --obstacles none.yaml", "none.yaml: there is no such file"),
    (f"{PROVEN} --from=-0.15,0,0.25 --to=0.5,0,0.2 --boxes 500",
     "to: found the pose 0.5,0,0.2,0,0,0: wrench-feasible fails: capac"),
    (f"{PROVEN} --from=0.5,0,0.2 --to=0.15,0,0.25 --boxes 500", "from: found the pose 0.5"),
    (f"{PROVEN} {LOW} --method best", "--method: found 'best'; accepted: sequ"),
    (f"{PROVEN} {LOW} --guess a.csv", "--guess: found with --proven; accepted: with --free"),
    (f"{PROVEN} --from=-0.15,0,0.25 --to=0.15,0,0.25,0,0,9 --acceleration 1",
     "--acceleration: found with a range of angles"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "said"), REFUSALS)
def test_bad_input_is_one_line_and_writes_nothing(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *words.split())
    assert code == 2
    assert re.search(said, err), err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
