"""Proven motions: judged exactly, tracked, in sets that are used again, among what moves."""

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import PlanningError, WorkspaceError
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.proofs.motions_in_sets import judged
from cdpr_drake.proofs.moving_clearances import moving_clearances
from cdpr_drake.proofs.proven_plan import plan_proven_motion
from cdpr_drake.proofs.proven_sets import PoseSets
from cdpr_drake.proofs.robot_sets import (
    ProofSettings,
    ProvenSets,
    accelerated_wrenches,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.cable_interference import box_row
from cdpr_drake.workspaces.demanded_wrenches import spatial_inertias
from tests.analyses.planning.plan_command import drawn, planned, run, summary, table, undrawn
from tests.messages import printed

ENDS = ["--from=-0.15,0,0.25", "--to=0.15,0,0.25"]
BOXES = 6000
ROBOT = "acrobot_small"

__all__ = ["undrawn"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Over a low wall."""
    files = tmp_path_factory.mktemp("proven")
    wall = files / "wall.yaml"
    wall.write_text("boxes: [{pose: {position: [0, 0, 0.12]}, size: [0.04, 0.5, 0.24]}]\n")
    words = ["--obstacles", str(wall), "--no-pulleys", "--boxes", str(BOXES)]
    planned(files / "out", ROBOT, "--proven", *ENDS, *words)
    return files / "out"


def test_the_command_writes_a_motion_that_is_proven_and_tracked(folder):
    answer = summary(folder)
    assert answer["proven"]["path"]
    assert answer["proven"]["motion"]
    assert answer["judged_samples"] == 2000
    kinds = ["wrench-feasible", "interference-free", "collision-free"]
    assert answer["judged_infeasible"] == dict.fromkeys(kinds, 0)
    assert answer["straight_m"] < answer["lower_bound"] <= answer["shortest_polyline_m"]
    assert answer["cost"] == answer["path_length_m"]
    assert max(answer["largest_accelerations_m_s2"]) <= 0.25 * (1.0 + 1e-9)
    assert answer["tracked"]["keeps_limits"]
    assert answer["largest_share_of_limits"] <= 1.0
    rows = table(folder)
    np.testing.assert_allclose(rows["x_m"][[0, -1]], [-0.15, 0.15], atol=1e-9)
    assert np.max(rows["z_m"]) > 0.27  # over the wall with the platform below Po
    assert drawn(folder, "sets", "accelerations", "tensions", "winches", "path")
    sets = PoseSets.load(folder / "sets.yaml")
    assert (len(sets), sets.about["kinds"]) == (answer["sets"]["count"], kinds)
    for row in rows[::100]:
        assert sets.covers(np.array([row["x_m"], row["y_m"], row["z_m"], 0, 0, 0]))


def test_a_scenario_tracks_it(folder):
    changes = [
        f"robot={ROBOT}", f"trajectory.file={folder / 'motion.csv'}", "trajectory.pause=0.02",
        "duration=0.5", "integration.engine=compiled",
    ]  # fmt: skip
    scenario = load_scenario("acrobot_computed_torque", changes)
    assert TensionRun(scenario).simulate().log["failures"][-1, 0] == 0


@pytest.mark.usefixtures("undrawn")
def test_a_free_motion_starts_from_it(capsys, folder, tmp_path):
    guess = str(folder / "motion.csv")
    words = ["--no-pulleys", "--no-track", "--guess", guess]
    answer = planned(tmp_path / "a", ROBOT, "--free", *ENDS, *words)
    assert answer["arguments"]["guess"] == guess
    assert answer["duration_s"] < summary(folder)["duration_s"]
    printed(capsys)
    code, _, err = run(capsys, ROBOT, "--free", ENDS[0], "--to=0.2,0,0.25", *words)
    assert (code, "guess: ends 0.05 m and 0 deg from there" in err) == (2, True)


@pytest.mark.usefixtures("undrawn")
def test_a_graph_of_convex_sets_is_no_shorter(tmp_path):
    words = [
        "--from=-0.1,0,0.3",
        "--to=0.1,0.1,0.3",
        "--no-pulleys",
        "--no-track",
        "--boxes",
        "800",
    ]
    sequences, gcs = (
        planned(tmp_path / method, ROBOT, "--proven", *words, "--method", method)
        for method in ("sequences", "gcs")
    )
    assert (sequences["method"], gcs["method"]) == ("sequences", "gcs")
    assert sequences["shortest_polyline_m"] <= gcs["shortest_polyline_m"] + 1e-6
    assert not any(gcs["judged_infeasible"].values())


def level(*place):
    return pose_from_angles(np.array(place, float), np.zeros(3))


def test_sets_are_the_same_every_time_and_used_again(tmp_path):
    wall = np.array([box_row([0, 0, 0.12], [0.04, 0.5, 0.24])])
    ends = [np.array([x, 0.0, 0.25, 0, 0, 0]) for x in (-0.15, 0.15)]
    settings = ProofSettings(boxes=BOXES, pulleys=False, cells=2**15)
    first, again = (
        ProvenSets.find(ROBOT, None, None, wall, 0.25, must=ends, settings=settings)
        for _ in range(2)
    )
    assert first.save(tmp_path / "a").read_bytes() == again.save(tmp_path / "b").read_bytes()
    random, R = np.random.default_rng(0), np.repeat(np.eye(3)[np.newaxis], 3000, axis=0)
    number = random.integers(0, len(first), 3000)
    inside = random.uniform(first.lower[number], first.upper[number])[:, :3]
    assert all(map(np.all, first.judge(inside, R).values()))  # the exact checks say so, too
    anywhere = first.judge(random.uniform(*load_robot(ROBOT).reach(), (3000, 3)), R)
    assert all(0.0 < np.mean(each) < 1.0 for each in anywhere.values())  # and can say otherwise
    start, goal = (level(*end[:3]) for end in ends)
    fast, short = (
        plan_proven_motion(ROBOT, start, goal, pulleys=False, sets=first, least_time=least_time)
        for least_time in (True, False)
    )
    assert fast.as_dict()["lower_bound"] <= fast.motion.end_time <= short.motion.end_time
    assert "proven motion" in repr(short)
    with pytest.raises(WorkspaceError, match=r"to: lies in none of \d+ sets: wrench-feasible"):
        plan_proven_motion(ROBOT, start, level(0.5, 0, 0.3), pulleys=False, sets=first)


def test_a_motion_that_turns_is_proven_with_angular_accelerations(tmp_path):
    words = [
        "acrobot_large", "--proven", "--from=-0.05,0,0.3,0,0,-1", "--to=0.05,0.02,0.3,0,0,1",
        "--no-pulleys", "--no-track",
    ]  # fmt: skip
    folder = tmp_path / "out"
    answer = planned(folder, *words, "--boxes", "6000", "--acceleration", "0.25,2")
    assert answer["proven"]["motion"]
    assert answer["proven"]["not_of"] == []
    assert "gyroscopic" in answer["proven"]["of"][0]
    assert not any(answer["judged_infeasible"].values())
    assert answer["sets"]["angular_accelerations_rad_s2"] == [2.0] * 3
    limits = np.array(answer["sets"]["moments_n_m"])
    assert np.all(np.array(answer["largest_moments_n_m"]) <= limits * (1.0 + 1e-9))
    assert max(answer["largest_accelerations_m_s2"]) == pytest.approx(0.25, rel=1e-3)
    assert answer["largest_share_of_limits"] <= 1.0
    assert len(table(folder)) > 100
    assert drawn(folder, "accelerations")
    assert PoseSets.load(folder / "sets.yaml").about["moments_n_m"] == limits.tolist()
    answer = planned(folder, *words, "--overwrite", "--boxes", "1500")
    assert not answer["proven"]["motion"]
    assert "no angular accelerations were asked for" in answer["proven"]["not_of"][0]
    assert "largest_moments_n_m" not in answer


@pytest.mark.parametrize(
    "widths", [np.zeros(3), np.full(2, 1.0), [0, 0, 0, 1, 1, 1], [-1, 1, 1, 1, 1, 1], [np.inf]]
)
def test_accelerations_that_make_no_box_are_refused(widths):
    with pytest.raises(WorkspaceError, match="accelerations: found"):
        ProvenSets.find(ROBOT, None, None, None, np.array(widths, float))


def test_accelerations_without_turns_are_wrenches_on_the_platform_at_rest():
    robot = load_robot("caroca")
    body, angles, a = rigid_platform(robot), np.array([0.1, -0.2, 0.3]), np.array([0.2, 0.3, 0.5])
    wrenches = accelerated_wrenches(robot, a, angles).vertices
    R = rotation_from_angles(angles).matrix()
    assert len(np.unique(wrenches, axis=0)) == 8
    np.testing.assert_allclose(np.max(wrenches[:, 3:], axis=0), body.mass * a)
    moments = np.cross(R @ body.p_PCo, wrenches[:, 3:])
    np.testing.assert_allclose(wrenches[:, :3], moments, atol=1e-12)
    assert spatial_inertias(body.mass, body.p_PCo, body.I_PPo, R).shape == (1, 6, 6)


def test_poses_that_sets_do_not_connect_are_refused_in_words():
    lower, upper = np.zeros((2, 6)), np.zeros((2, 6))
    lower[:, :3], upper[:, :3] = [[-0.2, -0.1, 0.2], [0.1, -0.1, 0.2]], [[-0.1, 0.1, 0.3]] * 2
    upper[1, 0] = 0.2
    about = {"accelerations_m_s2": None, "obstacles": [], "kinds": []}
    sets = ProvenSets(lower, upper, np.arange(3), about, cut=7)
    with pytest.raises(PlanningError, match=r"do not connect; accepted: .*; 7 open cells between"):
        plan_proven_motion(ROBOT, level(-0.15, 0, 0.25), level(0.15, 0, 0.25), sets=sets)


# Among what moves.

START, GOAL = level(-0.3, 0.1, 0.25), level(0.3, 0.1, 0.25)
AWAY, THERE = [0.0, -0.5, 0.2], [0.0, 0.0, 0.2]
PASSING = {"boxes": [
    {"pose": {"position": AWAY}, "size": [0.1, 0.1, 0.4], "motion": {"waypoints": [
        {"time": time, "pose": {"position": place}}
        for time, place in ((1.5, THERE), (5.0, THERE), (7.5, AWAY))
    ]}}
]}  # fmt: skip
"""A box that stands in the way from 1 s to 6 s, about."""


@pytest.fixture(scope="module")
def sets():
    must = [np.concatenate([X.translation(), np.zeros(3)]) for X in (START, GOAL)]
    settings = ProofSettings(boxes=BOXES, cells=2**13)
    return ProvenSets.find("acrobot_large", accelerations=0.25, must=must, settings=settings)


@pytest.fixture(scope="module")
def waiting(sets, tmp_path_factory):
    files = tmp_path_factory.mktemp("files")
    passing = files / "obstacles.yaml"
    passing.write_text(yaml.safe_dump(PASSING))
    return plan_proven_motion(
        "acrobot_large", START, GOAL, obstacles=passing, sets=sets, track=False,
        folder=files / "out",
    )  # fmt: skip


def test_a_plan_waits_for_what_passes_and_all_samples_hold(waiting, sets):
    answer = waiting.as_dict()
    assert answer["proven"]["motion"]
    assert answer["waits"]
    assert answer["moving"] == ["boxes[0]"]
    assert sum(answer["judged_infeasible"].values()) == 0
    count, failed = judged(sets, waiting.solution, waiting.things, 1000)
    assert count == 1000
    assert set(failed) >= {"wrench-feasible", "cables off what moves", "platform off what moves"}
    assert sum(failed.values()) == 0
    assert answer["lower_bound"] <= answer["cost"]
    assert "for ever" in " ".join(answer["proven"]["of"])


def test_a_plan_among_what_moves_writes_table_sets_figures_and_replay(waiting):
    assert not waiting.failed
    names = {path.name for path in waiting.folder.iterdir()}
    assert names >= {"motion.csv", "space_time.png", "sets.png", "replay.html"}
    assert summary(waiting.folder)["sets"]["count"] == len(waiting.sets)
    assert "time_s" in (waiting.folder / "sets.yaml").read_text()


def test_the_motion_that_knows_of_nothing_that_moves_is_hit(waiting, sets):
    unaware = plan_proven_motion("acrobot_large", START, GOAL, sets=sets)
    assert unaware.solution.duration < waiting.solution.duration
    times = np.linspace(0.0, unaware.motion.end_time, 500)
    p = np.array([unaware.motion.pose(t).translation() for t in times])
    R = np.repeat(np.eye(3)[np.newaxis, np.newaxis], len(times), axis=0)
    gaps = moving_clearances(waiting.around, waiting.things, times, p[:, np.newaxis], R)
    assert np.any(gaps <= 0.0)
    _, failed = judged(sets, unaware.solution, waiting.things, 500)
    assert failed["cables off what moves"] + failed["platform off what moves"] > 0
