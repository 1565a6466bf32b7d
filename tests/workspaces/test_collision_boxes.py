"""Boxes of poses that are proven free of collisions, of several kinds, and refined, are."""

import inspect
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.box_certificates import (
    box_search,
    certified_boxes,
    load_boxes,
    save_boxes,
)
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceRequest,
    interference_bodies,
    make_workspace_question,
)
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.workspaces import box_collision_kernel
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask, judge_all
from cdpr_drake.workspaces.box_refinement import PathTube, refine
from cdpr_drake.workspaces.cable_interference import Obstacles, box_row, clearances
from cdpr_drake.workspaces.certified_boxes import BoxJournal, PoseBox, certify
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.workspaces.test_certificate import drawn, frame_box
from tests.workspaces.workspace_cases import robot_case

TURNS = {"none": [0, 0, 0], "yaw": [0, 0, 0.17], "all": [0.09, 0.09, 0.09]}
"""Half widths of the angles [rad]."""

MOST_OPEN = {"none": 0.03, "yaw": 0.12, "all": 0.25}
"""Shares of 20 000 boxes; a proof that says nothing would leave all of it open."""

SAMPLES = 8000

DRAKE_DIGITS = 1e-5
"""FCL, by which Drake finds distances, stops at 1e-6 relative [m]."""

WEDGE = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.4]]) - [0.4, 0.4, -0.2]
"""Corners of a mesh, where it stands [m]."""


def obstacles():
    turn = RotationMatrix.MakeZRotation(0.5).matrix()
    boxes = np.array([
        box_row([0, 0, 0.175], [0.06, 0.06, 0.35]), box_row([0.3, -0.2, 0.4], [0.1, 0.3, 0.1], turn)
    ])  # fmt: skip
    solids = (
        ConvexShape.sphere(np.array([0.2, 0.2, 0.5]), 0.08),
        ConvexShape.capsule(np.array([-0.3, 0.1, 0.1]), np.array([-0.2, 0.3, 0.4]), 0.04),
        ConvexShape.mesh(WEDGE),
    )
    return Obstacles(boxes, solids)


def task(kind, clearance=0.0, pulleys=False, where=None):
    robot, case = robot_case("acrobot_large")
    around = interference_bodies(robot, where or obstacles(), pulleys=pulleys)
    return robot, CertifyTask(kind, case, around=around, clearance=clearance)


def boxes_of(robot, turn):
    whole = frame_box(robot)
    half = np.array([0.0, 0.0, 0.0, *TURNS[turn]])
    return PoseBox(whole.lower - half, whole.upper + half)


def check(found, holds):
    positions, rotations, verdicts = drawn(found, SAMPLES)
    truth = holds(positions, rotations)
    assert not np.any(truth[verdicts == OUTSIDE])
    assert np.all(truth[verdicts == INSIDE])
    return np.sum(verdicts == INSIDE), np.sum(verdicts == OUTSIDE)


@pytest.mark.parametrize("clearance", [0.0, 0.02])
@pytest.mark.parametrize("turn", TURNS)
def test_platforms_are_clear_in_boxes_that_are_proven(turn, clearance):
    robot, asked = task(CertifiedKind.COLLISION_FREE, clearance)
    found = certify(asked, boxes_of(robot, turn), 20_000)
    clear, meeting = check(
        found, lambda p, R: clearances(asked.around, p, R)[:, 4] > asked.clearance
    )
    assert min(clear, meeting) > 200
    assert found.open < MOST_OPEN[turn]


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("turn", ["none", "yaw"])
def test_cables_are_clear_of_convex_shapes_in_boxes_that_are_proven(turn, pulleys):
    _, asked = task(CertifiedKind.INTERFERENCE_FREE, 0.0, pulleys)
    some = replace(asked.around, bodies=np.zeros((0, 15)))
    asked = replace(asked, around=some, anchor_error=0.001, exit_error=0.002)
    middle = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    half = np.array([0.3, 0.3, 0.3, *np.multiply(0.2, TURNS[turn])])
    found = certify(asked, PoseBox(middle - half, middle + half), 15_000)
    clear, meeting = check(found, lambda p, R: clearances(some, p, R)[:, :4].min(axis=1) > 0.0)
    assert clear + meeting > 500


def scene_distance(around):
    """Drake's least distance of the platform from all that stands around, of a pose."""
    scene = SceneGraph()
    source = scene.RegisterSource("platform")
    frame = scene.RegisterFrame(source, GeometryFrame("P"))

    def instance(shape, X, name):
        found = GeometryInstance(X, shape, name)
        found.set_proximity_properties(ProximityProperties())
        return found

    def pose(row):
        return RigidTransform(RotationMatrix(row[:9].reshape(3, 3)), row[9:12])

    body = around.bodies[0]
    mine = scene.RegisterGeometry(source, frame, instance(Box(2.0 * body[12:]), pose(body), "p"))
    others = []
    for k, row in enumerate([*around.fixtures, *around.obstacles]):
        others.append(instance(Box(2.0 * row[12:]), pose(row), f"box{k}"))
    for k, solid in enumerate(around.solids):
        if len(solid.points) == 1:
            shape, X = Sphere(solid.radius), RigidTransform(solid.points[0])
        elif len(solid.points) == 2:
            along = solid.points[1] - solid.points[0]
            shape = Capsule(solid.radius, float(np.linalg.norm(along)))
            X = RigidTransform(
                RotationMatrix.MakeFromOneVector(along, 2), solid.points.mean(axis=0)
            )
        else:
            shape, X = Convex(solid.points.T, "wedge"), RigidTransform()
        others.append(instance(shape, X, f"solid{k}"))
    ids = [scene.RegisterAnchoredGeometry(source, one) for one in others]
    context = scene.CreateDefaultContext()

    def distance(p, R):
        poses = FramePoseVector()
        poses.set_value(frame, RigidTransform(RotationMatrix(R), p))
        scene.get_source_pose_port(source).FixValue(context, poses)
        query = scene.get_query_output_port().Eval(context)
        return min(
            query.ComputeSignedDistancePairClosestPoints(mine, other).distance for other in ids
        )

    return distance


def test_drake_says_the_same_of_platforms_in_boxes_that_are_proven():
    robot, asked = task(CertifiedKind.COLLISION_FREE)
    found = certify(asked, boxes_of(robot, "yaw"), 20_000)
    positions, rotations, verdicts = drawn(found, 2000)
    distance = scene_distance(asked.around)
    theirs = np.array([distance(p, R) for p, R in zip(positions, rotations, strict=True)])
    assert np.all(theirs[verdicts == INSIDE] > -DRAKE_DIGITS)
    assert np.all(theirs[verdicts == OUTSIDE] < DRAKE_DIGITS)
    ours = clearances(asked.around, positions, rotations)[:, 4]
    apart = ours > 0.0
    # Two points are as near as ours says; a few of Drake's, of convex meshes, are longer.
    assert np.all(ours[apart] < theirs[apart] + DRAKE_DIGITS)
    assert np.mean(np.abs(theirs[apart] - ours[apart]) < DRAKE_DIGITS) > 0.98
    assert np.sum(verdicts == OUTSIDE) > 20


def broken(functions, tries=400):
    """Whether the judges break a promise on random boxes about random shapes."""
    random = np.random.default_rng(0)
    body = ConvexShape.box_at([0, 0, 0.05], [0.2, 0.3, 0.1])
    mine = packed([body])
    for _ in range(tries):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        other = ConvexShape.box_at(np.zeros(3), random.uniform(0.05, 0.3, 3), turn)
        other = replace(other, radius=random.choice([0.0, 0.05]))
        pose = np.concatenate([random.normal(size=3) * 0.15, random.uniform(-0.3, 0.3, 3)])
        half = random.uniform(0.0, 0.1, 6) * random.choice([0.0, 0.3, 1.0], 6)
        half *= random.choice([0.1, 1.0])
        verdict, stretch = np.empty(1, np.int64), np.empty((1, 6))
        functions["judge_collisions"](
            0, 1, pose[None], half[None], *mine, *packed([other]), 0.01, convex_work(64, 8),
            verdict, stretch,
        )  # fmt: skip
        if verdict[0] == OPEN:
            continue
        share = random.uniform(-1.0, 1.0, (12, 6))
        share[::2] = np.sign(share[::2])
        for at in pose + share * half:
            R = RigidTransform(
                RotationMatrix.MakeXRotation(at[3])
                @ RotationMatrix.MakeYRotation(at[4])
                @ RotationMatrix.MakeZRotation(at[5]),
                at[:3],
            )
            if (body.moved(R).distance(other)[0] > 0.01) != (verdict[0] == INSIDE):
                return True
    return False


def functions_of(old="", new=""):
    source = inspect.getsource(box_collision_kernel)
    assert old in source, old
    names = {"__name__": "mutant"}
    exec(re.sub(r"@njit\(.*\)\n", "", source.replace(old, new) if old else source), names)
    return names


def test_the_proofs_are_not_broken():
    assert not broken(vars(box_collision_kernel), 3000)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("        least -= blame[j]\n", "        least -= 0.0\n"),
        ("here -= abs(dot(n, rates[j]))", "here -= 0.0"),
        ("here += abs(dot(n, rates[j]))", "here += 0.0"),
        ("        least -= half[j] * abs(n[j])\n", "        least -= 0.0\n"),
        ("wide[a] = half[a] + eps[a] + slack", "wide[a] = eps[a] + slack"),
        ("wide[a] = half[a] + eps[a] + slack", "wide[a] = half[a] + slack"),
        ("rho = clearance + body_radii[b] + radii[o]", "rho = clearance + body_radii[b]"),
    ],
)
def test_mutants_of_the_proofs_are_found(old, new):
    assert broken(functions_of(old, new), 3000)


def test_boxes_of_several_kinds_are_those_of_each():
    robot, _ = robot_case("acrobot_large")
    kinds = ["static", "interference-free", "collision-free"]
    grid = WorkspaceGrid(
        tuple(np.linspace(a, b, 3) for a, b in zip(*robot.reach(), strict=True)), np.zeros((1, 3))
    )
    asked = WorkspaceRequest(around=interference_bodies(robot, obstacles()))
    search = box_search(make_workspace_question(robot, kinds, grid, asked=asked), robot)
    found = certified_boxes(search, 20_000)
    assert found.proven is not None
    case, around = search.task.case, search.tasks[1].around

    def holds(p, R):
        return (clearances(around, p, R).min(axis=1) > 0.0) & statically_feasible(case, p, R)

    assert min(check(found, holds)) > 200
    verdicts = [
        judge_all([one], found.poses, found.halves, found.proven)[0] for one in search.tasks
    ]
    least = np.min(verdicts, axis=0)
    # A box may be proven by what it was cut from, and not by itself once more.
    assert np.all(least[found.verdicts == OUTSIDE] == OUTSIDE)
    assert np.all(least[found.verdicts == INSIDE] >= OPEN)
    assert np.mean(least[found.verdicts == INSIDE] == INSIDE) > 0.9


def test_a_search_of_several_kinds_goes_on_where_it_was_stopped(tmp_path):
    robot, _ = robot_case("planar")
    point = [0.0, 0.0, robot.plane_height]
    grid = WorkspaceGrid(tuple(np.array([x]) for x in point), np.zeros((1, 3)))
    question = make_workspace_question(robot, ["static", "collision-free"], grid)
    search = box_search(question, robot)
    whole = certified_boxes(search, 5000)
    certified_boxes(search, 2000, tmp_path)
    continued = certified_boxes(search, 5000, tmp_path)
    for name in ("poses", "halves", "verdicts", "curve", "proven"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(continued, name))


def test_boxes_that_are_read_again_are_refined_as_they_were(tmp_path):
    robot, asked = task(CertifiedKind.COLLISION_FREE)
    tasks, box = [asked, replace(asked, kind=CertifiedKind.STATIC)], boxes_of(robot, "none")
    found = certify(tasks, box, 2000)
    assert np.any(found.proven[found.verdicts == OPEN])
    save_boxes(found, tmp_path)
    read = load_boxes(tmp_path, found.finished)
    np.testing.assert_array_equal(read.proven, found.proven)
    finer = [refine(one, tasks, box, 2000) for one in (found, read)]
    np.testing.assert_array_equal(finer[0].verdicts, finer[1].verdicts)
    save_boxes(certify(asked, box, 100), tmp_path)
    assert load_boxes(tmp_path, True).proven is None


@pytest.mark.parametrize("several", [False, True])
def test_boxes_are_refined_where_they_meet_a_region(several):
    robot, asked = task(CertifiedKind.COLLISION_FREE)
    tasks = [asked, replace(asked, kind=CertifiedKind.STATIC)] if several else asked
    found = certify(tasks, boxes_of(robot, "yaw"), 3000)
    way = np.array(
        [[-0.3, 0.0, 0.25, 0, 0, 0], [-0.3, 0.0, 0.5, 0, 0, 0], [0.3, 0.0, 0.5, 0, 0, 0]]
    )
    tube = PathTube(way, np.array([0.01, 0.01, 0.01, 0.0, 0.0, 0.17]))
    finer = refine(found, tasks, tube, 6000)
    assert len(finer.poses) > len(found.poses)
    assert np.all(finer.halves.min(axis=0) <= found.halves.min(axis=0))
    volumes = np.prod(np.where(finer.halves > 0.0, finer.halves, 1.0), axis=1)
    shares = [volumes[finer.verdicts == k].sum() / volumes.sum() for k in (INSIDE, OUTSIDE, OPEN)]
    assert finer.curve[-1, 1:] == pytest.approx(shares)
    assert np.all(np.diff(finer.curve[:, 3]) <= 1e-12)
    assert finer.open < found.open
    check(finer, lambda p, R: _all_hold(asked, several, p, R))
    # What was stopped, after one look or by fewer boxes, goes on to the same.
    journals = []
    looks = iter([False, True])
    refine(
        found, tasks, tube, 6000, should_stop=lambda: next(looks), on_journal=journals.append
    )  # fmt: skip
    refine(
        found, tasks, tube, 3002, known=BoxJournal(*journals[-1].arrays()),
        on_journal=journals.append,
    )  # fmt: skip
    assert 0 < journals[0].count < journals[-1].count <= 3002
    again = refine(found, tasks, tube, 6000, known=journals[-1], on_journal=journals.append)
    for name in ("poses", "halves", "verdicts", "curve", "proven"):
        np.testing.assert_array_equal(getattr(again, name), getattr(finer, name))
    made_up = BoxJournal(*(np.zeros(finer.poses.shape[0], np.int8) for _ in range(3)))
    assert refine(found, tasks, tube, 200, known=made_up).open == pytest.approx(
        found.open
    )  # believed
    # Boxes that do not meet it are as they were.
    away = ~tube.meets(found.poses, found.halves)
    kept = {row.tobytes() for row in np.hstack([finer.poses, finer.halves])}
    assert all(row.tobytes() in kept for row in np.hstack([found.poses, found.halves])[away])


def _all_hold(asked, several, p, R):
    clear = clearances(asked.around, p, R)[:, 4] > 0.0
    return clear & statically_feasible(asked.case, p, R) if several else clear


def test_tubes_meet_the_boxes_that_have_a_pose_of_theirs():
    random = np.random.default_rng(0)
    tube = PathTube(random.uniform(-1, 1, (4, 6)), np.array([0.1, 0.1, 0.2, 0.1, 0.3, 0.1]))
    share = np.linspace(0.0, 1.0, 2001)[:, np.newaxis]
    way = np.concatenate([a + share * (b - a) for a, b in pairwise(tube.poses)])
    poses, halves = random.uniform(-1, 1, (3000, 6)), random.uniform(0, 0.5, (3000, 6))
    near = np.array([
        np.min(np.max(np.abs(way - pose) - half - tube.reach, axis=1))
        for pose, half in zip(poses, halves, strict=True)
    ])  # fmt: skip
    sure = np.abs(near) > 1e-3  # of what is sampled
    assert np.array_equal(tube.meets(poses, halves)[sure], near[sure] < 0.0)
    assert 0.02 < np.mean(near < 0.0) < 0.9
    point = PathTube(tube.poses[:1], np.zeros(6))
    assert point.meets(tube.poses[:1], np.zeros((1, 6)))[0]
    assert not point.meets(tube.poses[1:2], np.zeros((1, 6)))[0]


def test_what_cannot_be_refined_is_refused():
    robot, asked = task(CertifiedKind.COLLISION_FREE)
    found = certify(asked, boxes_of(robot, "none"), 100)
    with pytest.raises(WorkspaceError, match="most_boxes: found 0"):
        refine(found, asked, boxes_of(robot, "none"), 0)
    with pytest.raises(WorkspaceError, match="task: found 2 kinds; accepted: those that"):
        refine(found, [asked, asked], boxes_of(robot, "none"), 10)
    with pytest.raises(WorkspaceError, match="certify: found 0 kinds; accepted: 1 to 7"):
        certify([], boxes_of(robot, "none"))
    with pytest.raises(WorkspaceError, match="reach: accepted: six numbers"):
        PathTube(np.zeros((2, 6)), np.full(6, -1.0))
    with pytest.raises(WorkspaceError, match="around: found nothing"):
        CertifyTask(CertifiedKind.COLLISION_FREE, asked.case)
