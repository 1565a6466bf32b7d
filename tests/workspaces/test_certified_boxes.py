"""Boxes that are proven hold what they promise, at random poses and in corners; searches go on."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies, pose_conditions
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.proofs import box_judges
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.proofs.box_judges import CertifiedKind, CertifyTask, judge_all
from cdpr_drake.proofs.box_refinement import PathTube, refine
from cdpr_drake.proofs.certified_boxes import BoxJournal, certify
from cdpr_drake.proofs.certified_workspace import (
    box_search,
    certified_boxes,
    load_boxes,
    save_boxes,
)
from cdpr_drake.workspaces.cable_interference import Obstacles, Surroundings, box_row, clearances
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.workspaces.workspace_cases import (
    DrakeScene,
    box,
    box_about,
    check,
    drawn,
    frame_box,
    holds,
    pentagon,
    pulleys_at,
    robot_case,
    solid,
    upright,
)

DRAKE_DIGITS = 1e-5  # FCL, by which Drake finds distances, stops at 1e-6 relative [m]

STATIC, CLOSURE = CertifiedKind.STATIC, CertifiedKind.WRENCH_CLOSURE
INTERFERENCE, COLLISION = CertifiedKind.INTERFERENCE_FREE, CertifiedKind.COLLISION_FREE
FAILURE = CertifiedKind.SINGLE_FAILURE

TURNS = {"none": np.zeros(3), "yaw": np.array([0, 0, 0.17]), "all": np.full(3, 0.09)}  # [rad]

CAROCA, CONSTRAINED = (30.0, 10_000.0), (1.0, 60.0)  # [N]


# Tasks and boxes.


def static(name, limits=None, turn=0.0, ends=None):
    """The whole frame; over the robot's own pulleys, none, or some at the ends "A", "B"."""
    robot, case = robot_case(name, limits)
    if ends is not None:
        cables = case.cables.without_pulleys()
        case = replace(case, cables=pulleys_at(cables, ends, np.random.default_rng(3)))
    return CertifyTask(STATIC, case), frame_box(robot, turn)


def static_turned():
    middle, half = [0.1, -0.1, 0.3, 0.0, 0.0, 0.1], [0.03, 0.02, 0.02, 0.02, 0.01, 0.03]
    return CertifyTask(STATIC, robot_case("acrobot_large")[1]), box_about(middle, half)


def wrench_feasible():
    robot, case = robot_case("planar")
    required = SpatialSet(box=np.array([0, 0, 0.05, 2.0, 3.0, 0]))
    return CertifyTask(CertifiedKind.WRENCH_FEASIBLE, case, required), frame_box(robot)


def closure(name):
    robot, case = robot_case(name)
    return CertifyTask(CLOSURE, case), frame_box(robot)


def closure_pulleys():
    _, case = robot_case("acrobot_fully_constrained")
    case = replace(case, cables=pulleys_at(case.cables, "AB", np.random.default_rng(5)))
    middle, half = [0.1, 0.1, 0.5, 0.0, 0.0, 0.1], [0.3, 0.25, 0.3, 0.0, 0.0, 0.02]
    return CertifyTask(CLOSURE, case), box_about(middle, half)


def interference(clearance, turn=0.0, ends=None):
    """Of every other cable, which do not cross, so that something can be proven inside too."""
    robot, case = robot_case("acrobot_large")
    some = CableSet.make(case.cables.p_WA[:, ::2], case.cables.p_PB[:, ::2], 1.0)
    if ends:
        some = pulleys_at(some, ends, np.random.default_rng(2))
    around = Surroundings(
        some, np.full(4, 0.001), box_row([0, 0, 0.035], robot.platform.size)[None],
        obstacles=box_row([0.2, 0.1, 0.7], [0.2, 0.2, 0.2])[None], anchor_free=0.05,
    )  # fmt: skip
    half = np.array([0.2, 0.2, 0.2, turn, 0.0, turn])
    task = CertifyTask(INTERFERENCE, case, around=around, clearance=clearance)
    return task, box_about([0.05, 0.0, 0.3, 0.0, 0.0, 0.0], half)


def obstacles():
    turn = RotationMatrix.MakeZRotation(0.5).matrix()
    rows = [
        box_row([0, 0, 0.175], [0.06, 0.06, 0.35]), box_row([0.3, -0.2, 0.4], [0.1, 0.3, 0.1], turn)
    ]  # fmt: skip
    wedge = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.4]]) - [0.4, 0.4, -0.2]
    solids = (
        ConvexShape.sphere(np.array([0.2, 0.2, 0.5]), 0.08),
        ConvexShape.capsule(np.array([-0.3, 0.1, 0.1]), np.array([-0.2, 0.3, 0.4]), 0.04),
        ConvexShape.mesh(wedge),
    )
    return Obstacles(np.array(rows), solids)


def collision(turn, clearance=0.0):
    """The platform in the frame, among boxes and convex shapes."""
    robot, case = robot_case("acrobot_large")
    around = interference_bodies(robot, obstacles())
    return CertifyTask(COLLISION, case, around=around, clearance=clearance), frame_box(
        robot, TURNS[turn]
    )


def convex_interference(turn, pulleys):
    robot, case = robot_case("acrobot_large")
    around = interference_bodies(robot, obstacles(), pulleys=pulleys)
    around = replace(around, bodies=np.zeros((0, 15)))
    task = CertifyTask(INTERFERENCE, case, around=around, anchor_error=0.001, exit_error=0.002)
    half = np.array([0.3, 0.3, 0.3, *0.2 * TURNS[turn]])
    return task, box_about([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], half)


def failure():
    """Where segesta, of which single cables pull 40 N at most, survives breaks, pushed a little."""
    required = SpatialSet(box=np.array([0, 0, 0, 0.05, 0.05, 0.05]))
    task = CertifyTask(FAILURE, robot_case("segesta")[1], required)
    return task, box_about([0.0, 0.0, 0.62, 0, 0, 0], [0.08, 0.08, 0.08, 0, 0, 0])


BOXES = {
    "static acrobot": (lambda: static("acrobot_large"), 4000, 0.25, 0.1),
    "static over caroca's pulleys": (lambda: static("caroca", CAROCA), 3000, 0.08, 0.09),
    "static constrained": (
        lambda: static("acrobot_fully_constrained", CONSTRAINED), 3000, 0.03, 0.53
    ),
    "static planar": (lambda: static("planar"), 800, 0.58, 0.15),
    "static planar turned": (lambda: static("planar", turn=0.3), 3000, 0.47, 0.11),
    "static small and turned": (static_turned, 4000, 0.9, 0.0),
    "static straight": (lambda: static("acrobot_large", ends=""), 4000, 0.26, 0.17),
    "static over pulleys at both ends": (
        lambda: static("acrobot_fully_constrained", CONSTRAINED, ends="AB"), 6000, 0.01, 0.23
    ),
    "wrench-feasible planar": (wrench_feasible, 1000, 0.53, 0.19),
    "closure planar": (lambda: closure("planar"), 800, 0.63, 0.15),
    "closure constrained": (lambda: closure("acrobot_fully_constrained"), 3000, 0.05, 0.46),
    "closure over pulleys": (closure_pulleys, 3000, 0.18, 0.16),
    "interference": (lambda: interference(0.01), 3000, 0.34, 0.5),
    "interference, turned": (lambda: interference(0.01, turn=0.01), 10_000, 0.35, 0.5),
    "interference over pulleys": (lambda: interference(0.02, ends="AB"), 3000, 0.26, 0.53),
    "collision": (lambda: collision("none"), 6000, 0.74, 0.1),
    "collision, turned": (lambda: collision("all"), 10_000, 0.68, 0.05),
    "collision, yaw, 0.02 m": (lambda: collision("yaw", 0.02), 8000, 0.63, 0.11),
    "cables and solids, yaw": (lambda: convex_interference("yaw", False), 8000, 0.58, 0.09),
    "cables over pulleys and solids": (lambda: convex_interference("none", True), 6000, 0.6, 0.11),
    "failure, pushed": (failure, 500, 0.05, 0.0),
}  # fmt: skip
"""Task and box, most boxes, and least shares inside and outside; a proof that says less is worse.

Shares are those of today, 0.9 of them.
"""


@pytest.mark.parametrize("name", BOXES)
def test_proven_boxes_hold_what_they_promise(name):
    make, most, inside, outside = BOXES[name]
    task, whole = make()
    boxes = certify(task, whole, most)
    assert boxes.finished
    check(boxes, [task])
    assert boxes.inside >= inside
    assert boxes.outside >= outside


def test_robust_boxes_hold_for_points_that_are_off():
    task, whole = static("acrobot_large")
    off = 0.003
    exact = certify(task, whole, 4000)
    boxes = certify(replace(task, exit_error=off, anchor_error=off), whole, 4000)
    assert 0.0 < boxes.inside < exact.inside
    assert boxes.outside <= exact.outside
    random, cables = np.random.default_rng(3), task.case.cables
    for draw in range(5):
        shifts = random.normal(size=(2, 3, 8))
        shifts *= off / np.linalg.norm(shifts, axis=1, keepdims=True)
        moved = CableSet.make(cables.p_WA + shifts[0], cables.p_PB + shifts[1], 1.0)
        check(boxes, [replace(task, case=replace(task.case, cables=moved))], 1500, seed=draw)


def test_no_box_in_which_a_cable_might_not_run_is_inside():
    """Below an exit point a cable does not know to which side its pulley turns."""
    task, _ = static("caroca", CAROCA)
    exit_point = task.case.cables.p_WA[:, 0] - task.case.cables.p_PB[:, 0]
    middle = np.append(exit_point - [0.0, 0.0, 1.0], np.zeros(3))
    boxes = certify(task, box_about(middle, [0.2, 0.2, 0.5, 0, 0, 0]), 800)
    below = np.all(
        np.abs(boxes.poses[:, :2] - exit_point[:2]) <= boxes.halves[:, :2] + 1e-9, axis=1
    )
    assert np.any(below)
    assert np.all(np.isin(boxes.verdicts[below], (OPEN, OUTSIDE)))


def test_of_a_pentagon_the_one_of_its_diagonals_survives():
    """Four corners pull to everywhere in their hull: what all five hulls share is the pentagon
    that the diagonals enclose, smaller by the square of the golden ratio."""
    case = pentagon()
    inner = np.cos(0.4 * np.pi)  # distance of a diagonal from the middle
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (1000, 3)) * [1.0, 1.0, 0.0]
    depth = inner - np.max(points @ case.cables.p_WA, axis=1)  # positive: within all diagonals
    task = CertifyTask(FAILURE, case)
    clear = np.abs(depth) > 1e-4  # of the border smallest and largest tensions take a little
    held = holds(task, points, upright(1000))
    np.testing.assert_array_equal(held[clear], depth[clear] > 0.0)
    boxes = certify(task, box_about(np.zeros(6), [1.0, 1.0, 0, 0, 0, 0]), 4000)
    assert min(check(boxes, [task])) > 50
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    area = 2.5 * np.sin(0.4 * np.pi) / golden**4 / 4.0  # of the square of side 2
    assert boxes.inside < area < boxes.inside + boxes.open
    assert boxes.open < 0.2 * area


def test_drake_says_the_same_of_platforms_in_boxes_that_are_proven():
    task, whole = collision("yaw")
    boxes = certify(task, whole, 8000)
    positions, rotations, verdicts = drawn(boxes, 600)
    around = task.around
    standing = [box(row, f"box{k}") for k, row in enumerate([*around.fixtures, *around.obstacles])]
    standing += [solid(shape, f"solid{k}") for k, shape in enumerate(around.solids)]
    scene = DrakeScene([box(around.bodies[0])], standing)
    poses = (
        RigidTransform(RotationMatrix(R), p) for R, p in zip(rotations, positions, strict=True)
    )
    theirs = np.array([scene.distances(X).min() for X in poses])
    assert np.all(theirs[verdicts == INSIDE] > -DRAKE_DIGITS)
    assert np.all(theirs[verdicts == OUTSIDE] < DRAKE_DIGITS)
    ours = clearances(around, positions, rotations)[:, 4]
    apart = ours > 0.0
    # Two points are as near as ours says; a few of Drake's, of convex meshes, are longer.
    assert np.all(ours[apart] < theirs[apart] + DRAKE_DIGITS)
    assert np.mean(np.abs(theirs[apart] - ours[apart]) < DRAKE_DIGITS) > 0.98
    assert np.sum(verdicts == OUTSIDE) > 6


# Searches.


def same(one, other):
    for name in ("poses", "halves", "verdicts", "curve", "proven"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_the_open_part_shrinks_and_the_verdicts_can_be_looked_up():
    task, whole = static("planar")
    boxes = certify(task, whole, 2000)
    assert np.all(np.diff(boxes.curve[:, 3]) <= 1e-12)
    assert boxes.open < 0.2
    k = np.arange(0, len(boxes.poses), 97)
    np.testing.assert_array_equal(boxes.at(boxes.poses[k]), boxes.verdicts[k])
    assert boxes.at(np.full(6, 99.0))[0] == OPEN
    enough = certify(task, whole, 2000, open_share=0.5)
    assert enough.open <= 0.5
    assert len(enough.poses) < len(boxes.poses)


def test_a_search_can_be_stopped():
    calls = []
    boxes = certify(
        *static("planar"), 2000, on_progress=lambda n, share: calls.append(n),
        should_stop=lambda: len(calls) > 3,
    )  # fmt: skip
    assert not boxes.finished
    assert boxes.open > 0.0
    assert calls[-1] == boxes.curve[-1, 0]


def test_boxes_of_several_kinds_are_those_of_each():
    robot, _ = robot_case("acrobot_large")
    kinds = ["static", "interference-free", "collision-free"]
    about = pose_conditions(robot, around=interference_bodies(robot, obstacles()))
    search = box_search(robot, about, kinds, np.zeros((1, 3)))
    boxes = certified_boxes(search, 4000)
    assert min(check(boxes, search.tasks)) > 50
    verdicts = [
        judge_all([task], boxes.poses, boxes.halves, boxes.proven)[0] for task in search.tasks
    ]
    least = np.min(verdicts, axis=0)
    # A box may be proven by what it was cut from, and not by itself once more.
    assert np.all(least[boxes.verdicts == OUTSIDE] == OUTSIDE)
    assert np.all(least[boxes.verdicts == INSIDE] >= OPEN)
    assert np.mean(least[boxes.verdicts == INSIDE] == INSIDE) > 0.9


@pytest.mark.parametrize("kinds", [["static"], ["static", "collision-free"]])
def test_a_search_goes_on_where_it_was_stopped_and_judges_no_box_again(
    tmp_path, monkeypatch, kinds
):
    robot, _ = robot_case("planar")
    search = box_search(robot, pose_conditions(robot), kinds, np.zeros((1, 3)))
    judged, judge = [], box_judges._judge
    monkeypatch.setattr(
        box_judges, "_judge",
        lambda task, *boxes: judged.append(len(boxes[0])) or judge(task, *boxes),
    )  # fmt: skip
    whole, once = certified_boxes(search, 2500), sum(judged)
    with Folder(tmp_path, {}) as folder:
        certified_boxes(search, 1000, folder)
        before = sum(judged)
        same(whole, certified_boxes(search, 2500, folder))
    assert sum(judged) - before < once


def test_boxes_that_are_read_again_are_refined_as_they_were(tmp_path):
    task, whole = collision("none")
    tasks = [task, replace(task, kind=STATIC)]
    boxes = certify(tasks, whole, 1000)
    assert np.any(boxes.proven[boxes.verdicts == OPEN])
    with Folder(tmp_path, {}) as folder:
        save_boxes(boxes, folder)
        read = load_boxes(tmp_path, boxes.finished)
        np.testing.assert_array_equal(read.proven, boxes.proven)
        same(refine(boxes, tasks, whole, 1000), refine(read, tasks, whole, 1000))
        save_boxes(certify(task, whole, 100), folder)
        assert load_boxes(tmp_path, True).proven is None


@pytest.mark.parametrize("several", [False, True])
def test_boxes_are_refined_where_they_meet_a_region(several):
    task, whole = collision("yaw")
    tasks = [task, replace(task, kind=STATIC)] if several else [task]
    boxes = certify(tasks, whole, 1500)
    way = np.array(
        [[-0.3, 0.0, 0.25, 0, 0, 0], [-0.3, 0.0, 0.5, 0, 0, 0], [0.3, 0.0, 0.5, 0, 0, 0]]
    )
    tube = PathTube(way, np.array([0.01, 0.01, 0.01, 0.0, 0.0, 0.17]))
    finer = refine(boxes, tasks, tube, 3000)
    assert len(finer.poses) > len(boxes.poses)
    assert np.all(finer.halves.min(axis=0) <= boxes.halves.min(axis=0))
    assert np.all(np.diff(finer.curve[:, 3]) <= 1e-12)
    assert finer.open < boxes.open
    check(finer, tasks)
    # Boxes that do not meet it are as they were.
    away = ~tube.meets(boxes.poses, boxes.halves)
    kept = {row.tobytes() for row in np.hstack([finer.poses, finer.halves])}
    assert all(row.tobytes() in kept for row in np.hstack([boxes.poses, boxes.halves])[away])
    # What was stopped, after one look or by fewer boxes, goes on to the same.
    journals, looks = [], iter([False, True])
    keep = {"on_journal": journals.append}
    refine(boxes, tasks, tube, 3000, should_stop=lambda: next(looks), **keep)
    refine(boxes, tasks, tube, 1502, known=BoxJournal(*journals[-1].arrays()), **keep)
    assert 0 < journals[0].count < journals[-1].count <= 1502
    same(refine(boxes, tasks, tube, 3000, known=journals[-1], **keep), finer)
    made_up = BoxJournal(*(np.zeros(len(finer.poses), np.int8) for _ in range(3)))
    believed = refine(boxes, tasks, tube, 200, known=made_up)
    assert believed.open == pytest.approx(boxes.open)


def test_tubes_meet_the_boxes_that_have_a_pose_of_theirs():
    random = np.random.default_rng(0)
    tube = PathTube(random.uniform(-1, 1, (4, 6)), np.array([0.1, 0.1, 0.2, 0.1, 0.3, 0.1]))
    share = np.linspace(0.0, 1.0, 1001)[:, np.newaxis]
    way = np.concatenate([a + share * (b - a) for a, b in pairwise(tube.poses)])
    poses, halves = random.uniform(-1, 1, (600, 6)), random.uniform(0, 0.5, (600, 6))
    near = np.array([
        np.min(np.max(np.abs(way - pose) - half - tube.reach, axis=1))
        for pose, half in zip(poses, halves, strict=True)
    ])  # fmt: skip
    sure = np.abs(near) > 2e-3  # of what is sampled
    assert np.array_equal(tube.meets(poses, halves)[sure], near[sure] < 0.0)
    assert 0.02 < np.mean(near < 0.0) < 0.9
    point = PathTube(tube.poses[:1], np.zeros(6))
    assert point.meets(tube.poses[:1], np.zeros((1, 6)))[0]
    assert not point.meets(tube.poses[1:2], np.zeros((1, 6)))[0]
