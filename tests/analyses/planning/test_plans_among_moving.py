"""Plans among what moves: files, a whole plan with its figures, and what is refused."""

import json

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.planning.proven_plan import plan_proven_motion
from cdpr_drake.analyses.planning.timed_plan import judged_in_time
from cdpr_drake.analyses.workspaces.proven_sets import ProofSettings, ProvenSets
from cdpr_drake.analyses.workspaces.workspace_files import load_all_obstacles, load_obstacles
from cdpr_drake.errors import DataFileError, PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.workspaces.moving_clearances import moving_clearances

ROBOT = "acrobot_large"
START, GOAL = (pose_from_angles(np.array([x, 0.1, 0.25]), np.zeros(3)) for x in (-0.3, 0.3))
AWAY, THERE = [0.0, -0.5, 0.2], [0.0, 0.0, 0.2]
PLACES = ((1.5, THERE), (5.0, THERE), (7.5, AWAY))
WAY = [{"time": time, "pose": {"position": place}} for time, place in PLACES]
PASSING = {"boxes": [
    {"pose": {"position": AWAY}, "size": [0.1, 0.1, 0.4], "motion": {"waypoints": WAY}}
]}  # fmt: skip
"""A box that stands in the way from 1 s to 6 s, about."""


def write(folder, content):
    path = folder / "obstacles.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.fixture(scope="module")
def sets():
    numbers = [np.concatenate([X.translation(), np.zeros(3)]) for X in (START, GOAL)]
    settings = ProofSettings(boxes=6000, cells=2**13)
    return ProvenSets.find(ROBOT, accelerations=0.25, must=numbers, settings=settings)


@pytest.fixture(scope="module")
def run(sets, tmp_path_factory):
    files = tmp_path_factory.mktemp("files")
    path = write(files, PASSING)
    return plan_proven_motion(
        ROBOT, START, GOAL, obstacles=path, sets=sets, track=False, folder=files / "out"
    )


def test_a_plan_waits_for_what_passes_and_all_samples_hold(run, sets):
    told = run.as_dict()
    assert told["proven"]["motion"]
    assert told["waits"]
    assert told["moving"] == ["boxes[0]"]
    assert sum(told["judged_infeasible"].values()) == 0
    count, failed = judged_in_time(sets, run.in_sets, run.things, run.around, 1000)
    assert count == 1000
    assert set(failed) >= {"wrench-feasible", "cables off what moves", "platform off what moves"}
    assert sum(failed.values()) == 0
    assert told["lower_bound"] <= told["cost"]
    assert "for ever" in " ".join(told["proven"]["of"])


def test_the_motion_that_knows_of_nothing_that_moves_is_hit(run, sets):
    unaware = plan_proven_motion(ROBOT, START, GOAL, sets=sets)
    motion = unaware.motion
    times = np.linspace(0.0, motion.end_time, 500)
    p = np.array([motion.pose(t).translation() for t in times])
    R = np.repeat(np.eye(3)[np.newaxis, np.newaxis], len(times), axis=0)
    gaps = moving_clearances(run.around, run.things, times, p[:, np.newaxis], R)
    assert np.any(gaps <= 0.0)
    assert unaware.solution.duration < run.solution.duration


def test_a_plan_writes_table_sets_figures_and_replay(run):
    assert not run.failed
    names = {path.name for path in run.folder.iterdir()}
    assert names >= {"motion.csv", "summary.json", "sets.yaml", "space_time.png", "sets.png",
                     "replay.html"}  # fmt: skip
    told = json.loads((run.folder / "summary.json").read_text())
    assert told["sets"]["count"] == len(run.sets)
    assert "time_s" in (run.folder / "sets.yaml").read_text()


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ({"waypoints": WAY[::-1]}, "motion.waypoints: .*growing"),
        ({"velocity": [1, 0, 0], "joint": {"point": AWAY, "axis": [0, 0, 1]}}, "motion: .*one of"),
        ({"speed": 1.0}, "motion.*speed"),
    ],
)
def test_a_motion_that_is_not_accepted_is_named(tmp_path, motion, words):
    box = {"pose": {"position": AWAY}, "size": [0.1, 0.1, 0.1], "motion": motion}
    with pytest.raises(DataFileError, match=rf"boxes\[0\].{words}"):
        load_all_obstacles(write(tmp_path, {"boxes": [box]}))


def test_what_moves_is_refused_where_nothing_may_move(tmp_path):
    path = write(tmp_path, PASSING)
    with pytest.raises(DataFileError, match=r"boxes\[0\]: found an obstacle that moves"):
        load_obstacles(path)


def test_all_shapes_and_other_robots_move(tmp_path):
    velocity = {"velocity": [0.1, 0.0, 0.0]}
    (tmp_path / "tip.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n")
    path = write(tmp_path, {
        "boxes": [{"pose": {"position": AWAY}, "size": [0.1, 0.1, 0.1]}],
        "spheres": [{"position": AWAY, "radius": 0.1, "motion": velocity}],
        "capsules": [
            {"start": AWAY, "end": [0.0, -0.5, 0.6], "radius": 0.02, "motion": velocity}
        ],
        "meshes": [{"file": "tip.obj", "pose": {"position": AWAY}, "motion": velocity}],
        "robots": [{"robot": ROBOT, "pose": {"position": [0, 0, -0.5]}, "beams": False}],
    })  # fmt: skip
    resting, moving = load_all_obstacles(path)
    assert len(resting.boxes) == 1
    assert [thing.name for thing in moving] == [
        "spheres[0]", "capsules[0]", "meshes[0]", f"robots[0] {ROBOT}"
    ]  # fmt: skip
    capsule = moving[1].at(2.0)[0]
    np.testing.assert_allclose(capsule.points, [[0.2, -0.5, 0.2], [0.2, -0.5, 0.6]], atol=1e-12)
    assert len(moving[3].at(0.0)) == 9


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        ({"robot": ROBOT, "plan": "nowhere"}, r"robots\[0\].plan: .*no such file"),
        ({"robot": "nobody"}, r"robots\[0\].robot: .*nobody"),
    ],
)
def test_a_robot_or_its_plan_that_is_not_there_is_named(tmp_path, robot, words):
    path = write(tmp_path, {"robots": [{"pose": {"position": AWAY}, **robot}]})
    with pytest.raises(DataFileError, match=words):
        load_all_obstacles(path)


def test_what_is_not_planned_among_what_moves_is_refused(tmp_path, sets):
    path = write(tmp_path, PASSING)
    turned = pose_from_angles(GOAL.translation(), np.array([0.0, 0.0, 0.1]))
    for goal, more, words in (
        (turned, {}, "found two orientations"),
        (GOAL, {"method": "gcs"}, "method: found 'gcs'"),
        (GOAL, {"accelerations": 0.0}, "accelerations: found 0"),
    ):
        with pytest.raises(PlanningError, match=words):
            plan_proven_motion(ROBOT, START, goal, obstacles=path, **more)
