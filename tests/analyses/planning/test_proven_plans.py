"""Proven motions from the command line: judged exactly, refused in one line, tracked."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.planning.proven_plan import plan_proven_motion
from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.analyses.workspaces.proven_sets import (
    ProofSettings,
    ProvenSets,
    accelerated_wrenches,
)
from cdpr_drake.errors import PlanningError, WorkspaceError
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.cable_interference import box_row
from cdpr_drake.workspaces.demanded_wrenches import spatial_inertias
from cdpr_drake.workspaces.proven_sets import PoseSets
from tests.analyses.planning.plan_command import WRITES, drawn, run, undrawn
from tests.analyses.planning.plan_command import planned as written

ENDS = ["--from=-0.15,0,0.25", "--to=0.15,0,0.25"]
LOW = "boxes: [{pose: {position: [0, 0, 0.12]}, size: [0.04, 0.5, 0.24]}]\n"
BOXES = 6000
ROBOT = "acrobot_small"


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """Over a low wall."""
    folder = tmp_path_factory.mktemp("proven")
    (folder / "wall.yaml").write_text(LOW)
    written(
        folder / "out", ROBOT, "--proven", *ENDS, "--obstacles", str(folder / "wall.yaml"),
        "--no-pulleys", "--boxes", str(BOXES),
    )  # fmt: skip
    return folder / "out"


def test_the_command_writes_a_motion_that_is_proven_and_tracked(planned):
    told = json.loads((planned / "summary.json").read_text())
    assert told["proven"]["path"]
    assert told["proven"]["motion"]
    assert told["judged_samples"] == 2000
    assert told["judged_infeasible"] == {
        "wrench-feasible": 0, "interference-free": 0, "collision-free": 0,
    }  # fmt: skip
    assert told["straight_m"] < told["lower_bound"] <= told["shortest_polyline_m"]
    assert told["cost"] == told["path_length_m"]
    assert max(told["largest_accelerations_m_s2"]) <= 0.25 * (1.0 + 1e-9)
    assert told["tracked"]["keeps_limits"]
    assert told["largest_share_of_limits"] <= 1.0
    table = np.genfromtxt(planned / "motion.csv", delimiter=",", names=True)
    assert table["x_m"][0] == pytest.approx(-0.15, abs=1e-12)
    assert table["x_m"][-1] == pytest.approx(0.15, abs=1e-9)
    assert np.max(table["z_m"]) > 0.27  # over the wall with the platform below Po
    assert drawn(planned, "sets", "accelerations", "tensions", "winches", "path")


def test_the_sets_that_are_written_hold_the_motion(planned):
    told = json.loads((planned / "summary.json").read_text())
    sets = PoseSets.load(planned / "sets.yaml")
    assert len(sets) == told["sets"]["count"]
    assert sets.about["kinds"] == ["wrench-feasible", "interference-free", "collision-free"]
    table = np.genfromtxt(planned / "motion.csv", delimiter=",", names=True)
    for row in table[::100]:
        assert sets.covers(np.array([row["x_m"], row["y_m"], row["z_m"], 0, 0, 0]))


def test_a_scenario_tracks_it(planned):
    scenario = load_scenario(
        "acrobot_computed_torque",
        [
            f"robot={ROBOT}", f"trajectory.file={planned / 'motion.csv'}",
            "trajectory.pause=0.02", "duration=0.5", "integration.engine=compiled",
        ],
    )  # fmt: skip
    assert run_tension_scenario(scenario).log["failures"][-1, 0] == 0


def test_a_free_motion_starts_from_it(capsys, monkeypatch, planned, tmp_path):
    monkeypatch.setattr(WRITES, undrawn)
    guess = str(planned / "motion.csv")
    asked = ["--no-pulleys", "--no-track", "--json", "--guess", guess, "--out", str(tmp_path / "a")]
    code, out, _ = run(capsys, ROBOT, "--free", *ENDS, *asked)
    assert code == 0
    told = json.loads(out)
    assert told["arguments"]["guess"] == guess
    proven = json.loads((planned / "summary.json").read_text())
    assert told["duration_s"] < proven["duration_s"]
    code, _, err = run(capsys, ROBOT, "--free", ENDS[0], "--to=0.2,0,0.25", *asked, "--overwrite")
    assert code == 2
    assert "guess: ends 0.05 m and 0 deg from there" in err


def test_a_graph_of_convex_sets_is_no_shorter(tmp_path):
    few = ["--from=-0.1,0,0.3", "--to=0.1,0.1,0.3", "--no-pulleys", "--no-track", "--boxes", "800"]
    told = [
        written(tmp_path / method, ROBOT, "--proven", *few, "--method", method, pictures=False)
        for method in ("sequences", "gcs")
    ]
    assert [one["method"] for one in told] == ["sequences", "gcs"]
    assert told[0]["shortest_polyline_m"] <= told[1]["shortest_polyline_m"] + 1e-6
    assert not any(told[1]["judged_infeasible"].values())


def test_sets_are_the_same_every_time_and_used_again(tmp_path):
    wall = np.array([box_row([0, 0, 0.12], [0.04, 0.5, 0.24])])
    ends = [np.array([x, 0.0, 0.25, 0, 0, 0]) for x in (-0.15, 0.15)]
    settings = ProofSettings(boxes=BOXES, pulleys=False, cells=2**15)
    first, again = (
        ProvenSets.find(ROBOT, None, None, wall, 0.25, must=ends, settings=settings)
        for _ in range(2)
    )
    assert first.save(tmp_path / "a").read_bytes() == again.save(tmp_path / "b").read_bytes()
    random = np.random.default_rng(0)
    number = random.integers(0, len(first), 3000)
    poses = random.uniform(first.lower[number], first.upper[number])[:, :3]
    held = first.judge(poses, np.repeat(np.eye(3)[np.newaxis], 3000, axis=0))
    assert all(np.all(one) for one in held.values())  # the exact checks say so, too
    everywhere = random.uniform(*load_robot(ROBOT).reach(), (3000, 3))
    some = first.judge(everywhere, np.repeat(np.eye(3)[np.newaxis], 3000, axis=0))
    assert all(0.0 < np.mean(one) < 1.0 for one in some.values())  # and can say otherwise
    start, goal = (pose[:3].tolist() for pose in ends)
    fast = plan_proven_motion(
        ROBOT, _pose(start), _pose(goal), pulleys=False, sets=first, least_time=True
    )
    short = plan_proven_motion(ROBOT, _pose(start), _pose(goal), pulleys=False, sets=first)
    assert fast.motion.end_time <= short.motion.end_time
    assert fast.as_dict()["lower_bound"] <= fast.motion.end_time
    assert "proven motion" in repr(short)
    with pytest.raises(WorkspaceError, match=r"to: lies in none of \d+ sets: wrench-feasible"):
        plan_proven_motion(ROBOT, _pose(start), _pose([0.5, 0, 0.3]), pulleys=False, sets=first)


def test_a_motion_that_turns_is_proven_with_angular_accelerations(capsys, tmp_path):
    asked = [
        "acrobot_large", "--proven", "--from=-0.05,0,0.3,0,0,-1", "--to=0.05,0.02,0.3,0,0,1",
        "--no-pulleys", "--no-track", "--json", "--out", str(tmp_path / "out"),
    ]  # fmt: skip
    code, out, _ = run(capsys, *asked, "--boxes", "6000", "--acceleration", "0.25,2")
    assert code == 0
    told = json.loads(out)
    assert told["proven"]["motion"]
    assert told["proven"]["not_of"] == []
    assert "gyroscopic" in told["proven"]["of"][0]
    assert not any(told["judged_infeasible"].values())
    assert told["sets"]["angular_accelerations_rad_s2"] == [2.0] * 3
    limits = np.array(told["sets"]["moments_n_m"])
    assert np.all(np.array(told["largest_moments_n_m"]) <= limits * (1.0 + 1e-9))
    assert max(told["largest_accelerations_m_s2"]) == pytest.approx(0.25, rel=1e-3)
    assert told["largest_share_of_limits"] <= 1.0
    table = np.genfromtxt(tmp_path / "out" / "motion.csv", delimiter=",", names=True)
    assert len(table) > 100
    assert drawn(tmp_path / "out", "accelerations")
    sets = PoseSets.load(tmp_path / "out" / "sets.yaml")
    assert sets.about["moments_n_m"] == limits.tolist()
    code, out, _ = run(capsys, *asked, "--overwrite", "--boxes", "1500")
    told = json.loads(out)
    assert not told["proven"]["motion"]
    assert "no angular accelerations were asked for" in told["proven"]["not_of"][0]
    assert "largest_moments_n_m" not in told


@pytest.mark.parametrize(
    "given", [np.zeros(3), np.full(2, 1.0), [0, 0, 0, 1, 1, 1], [-1, 1, 1, 1, 1, 1], [np.inf]]
)
def test_accelerations_that_make_no_box_are_refused(given):
    with pytest.raises(WorkspaceError, match="accelerations: found"):
        ProvenSets.find(ROBOT, None, None, None, np.array(given, float))


def _pose(position):
    X = np.eye(4)
    X[:3, 3] = position
    return X


def test_accelerations_without_turns_are_wrenches_on_the_platform_at_rest():
    robot = load_robot("caroca")
    body, angles, a = rigid_platform(robot), np.array([0.1, -0.2, 0.3]), np.array([0.2, 0.3, 0.5])
    found = accelerated_wrenches(robot, a, angles).vertices
    R = rotation_from_angles(angles).matrix()
    assert len(np.unique(found, axis=0)) == 8
    np.testing.assert_allclose(np.max(found[:, 3:], axis=0), body.mass * a)
    c = R @ body.p_PCo
    np.testing.assert_allclose(found[:, :3], np.cross(c, found[:, 3:]), atol=1e-12)
    assert spatial_inertias(body.mass, body.p_PCo, body.I_PPo, R).shape == (1, 6, 6)


def test_poses_that_sets_do_not_connect_are_refused_in_words():
    lower, upper = np.zeros((2, 6)), np.zeros((2, 6))
    lower[:, :3], upper[:, :3] = [[-0.2, -0.1, 0.2], [0.1, -0.1, 0.2]], [[-0.1, 0.1, 0.3]] * 2
    upper[1, 0] = 0.2
    about = {"accelerations_m_s2": None, "obstacles": [], "kinds": []}
    made = ProvenSets(lower, upper, np.arange(3), about, cut=7)
    with pytest.raises(PlanningError, match=r"do not connect; accepted: .*; 7 open cells between"):
        plan_proven_motion(ROBOT, _pose([-0.15, 0, 0.25]), _pose([0.15, 0, 0.25]), sets=made)
