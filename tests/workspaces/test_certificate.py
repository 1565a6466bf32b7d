"""Boxes that are proven hold what they promise."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances
from cdpr_drake.workspaces.certified_boxes import PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, resisting
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, closure_margins
from tests.workspaces.workspace_cases import robot_case


def frame_box(robot, turn=0.0):
    lower, upper = robot.frame.lower.copy(), robot.frame.upper.copy()
    angles = np.full(3, turn)
    if robot.is_planar():
        lower[2] = upper[2] = robot.plane_height
        angles[:2] = 0.0
    return PoseBox(np.concatenate([lower, -angles]), np.concatenate([upper, angles]))


def drawn(found, count, seed=0):
    """Poses in the boxes, a half of them in corners, and their boxes' verdicts."""
    random = np.random.default_rng(seed)
    which = random.integers(0, len(found.poses), count)
    share = random.uniform(-1, 1, (count, 6))
    share[::2] = np.sign(share[::2])
    poses = found.poses[which] + share * found.halves[which] * (1.0 - 1e-9)
    turns = np.array([rotation_from_angles(a).matrix() for a in poses[:, 3:]])
    return poses[:, :3], turns, found.verdicts[which]


def check(found, holds, least=0.2):
    """No proven box breaks its promise; enough is proven to say something."""
    positions, rotations, verdicts = drawn(found, 20_000)
    truth = holds(positions, rotations)
    assert not np.any(truth[verdicts == OUTSIDE])
    assert np.all(truth[verdicts == INSIDE])
    assert found.inside + found.outside + found.open == pytest.approx(1.0)
    assert found.inside + found.outside > least
    volumes = np.prod(np.where(found.halves > 0.0, 2.0 * found.halves, 1.0), axis=1)
    total = volumes.sum()
    for verdict, share in ((INSIDE, found.inside), (OUTSIDE, found.outside), (OPEN, found.open)):
        assert volumes[found.verdicts == verdict].sum() / total == pytest.approx(share, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "limits", "turn", "boxes"),
    [
        ("acrobot_large", None, 0.0, 12_000),
        ("caroca", (30.0, 10_000.0), 0.0, 6000),
        ("acrobot_fully_constrained", (1.0, 60.0), 0.0, 6000),
        ("planar", None, 0.0, 1500),
        ("planar", None, 0.3, 8000),
    ],
)
def test_static_boxes(name, limits, turn, boxes):
    robot, case = robot_case(name, limits)
    found = certify(CertifyTask(CertifiedKind.STATIC, case), frame_box(robot, turn), boxes)
    assert found.finished
    check(found, lambda p, R: statically_feasible(case, p, R))


def test_boxes_with_orientations_of_a_spatial_robot():
    _, case = robot_case("acrobot_large")
    half = np.array([0.03, 0.02, 0.02, 0.02, 0.01, 0.03])
    middle = np.array([0.1, -0.1, 0.3, 0.0, 0.0, 0.1])
    box = PoseBox(middle - half, middle + half)
    found = certify(CertifyTask(CertifiedKind.STATIC, case), box, 8000)
    check(found, lambda p, R: statically_feasible(case, p, R))


def test_wrench_feasible_boxes():
    robot, case = robot_case("planar")
    required = SpatialSet(box=np.array([0, 0, 0.05, 2.0, 3.0, 0]))
    task = CertifyTask(CertifiedKind.WRENCH_FEASIBLE, case, required)
    found = certify(task, frame_box(robot), 2000)
    check(
        found,
        lambda p, R: capacity_margins(case, p, R, resisting(case, required, R)).feasible,
    )


@pytest.mark.parametrize(("name", "boxes"), [("planar", 1500), ("acrobot_fully_constrained", 8000)])
def test_closure_boxes(name, boxes):
    robot, case = robot_case(name)
    found = certify(CertifyTask(CertifiedKind.WRENCH_CLOSURE, case), frame_box(robot), boxes)
    check(found, lambda p, R: closure_margins(case, p, R) > 0.0)


@pytest.mark.parametrize(
    ("clearance", "turn", "boxes", "proven"),
    [(0.01, 0.0, 6000, "inside"), (0.01, 0.01, 20_000, "inside"), (0.04, 0.0, 6000, "outside")],
)
def test_interference_boxes(clearance, turn, boxes, proven):
    """Of every other cable, which do not cross, so that something can be proven inside too."""
    robot, case = robot_case("acrobot_large")
    some = CableSet.make(case.cables.p_WA[:, ::2], case.cables.p_PB[:, ::2], 1.0)
    around = Surroundings(
        some, np.full(4, 0.001), box_row([0, 0, 0.035], robot.platform.size)[None],
        obstacles=box_row([0.2, 0.1, 0.7], [0.2, 0.2, 0.2])[None], anchor_free=0.05,
    )  # fmt: skip
    task = CertifyTask(CertifiedKind.INTERFERENCE_FREE, case, around=around, clearance=clearance)
    middle = np.array([0.05, 0.0, 0.3, 0.0, 0.0, 0.0])
    half = np.array([0.2, 0.2, 0.2, turn, 0.0, turn])
    found = certify(task, PoseBox(middle - half, middle + half), boxes)
    check(found, lambda p, R: clearances(around, p, R)[:, :4].min(axis=1) > clearance, 0.1)
    assert getattr(found, proven) > 0.1


def test_robust_boxes_hold_for_points_that_are_off():
    robot, case = robot_case("acrobot_large")
    off = 0.003
    task = CertifyTask(CertifiedKind.STATIC, case, exit_error=off, anchor_error=off)
    exact = certify(CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), 8000)
    found = certify(task, frame_box(robot), 8000)
    assert found.inside < exact.inside
    assert found.outside <= exact.outside
    random = np.random.default_rng(3)
    for draw in range(10):
        shifts = random.normal(size=(2, 3, 8))
        shifts *= off / np.linalg.norm(shifts, axis=1, keepdims=True)
        cables = CableSet.make(case.cables.p_WA + shifts[0], case.cables.p_PB + shifts[1], 1.0)
        other = replace(case, cables=cables)
        positions, rotations, verdicts = drawn(found, 4000, seed=draw)
        truth = statically_feasible(other, positions, rotations)
        assert np.all(truth[verdicts == INSIDE])
        assert not np.any(truth[verdicts == OUTSIDE])


def test_the_open_part_shrinks_and_the_verdicts_can_be_looked_up():
    robot, case = robot_case("planar")
    found = certify(CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), 4000)
    assert np.all(np.diff(found.curve[:, 3]) <= 1e-12)
    assert found.open < 0.2
    k = np.arange(0, len(found.poses), 97)
    np.testing.assert_array_equal(found.at(found.poses[k]), found.verdicts[k])
    assert found.at(np.full(6, 99.0))[0] == OPEN
    enough = certify(
        CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), 4000, open_share=0.5
    )
    assert enough.open <= 0.5
    assert len(enough.poses) < len(found.poses)


def test_it_can_be_stopped():
    robot, case = robot_case("planar")
    told = []
    found = certify(
        CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), 4000,
        on_progress=lambda n, share: told.append((n, share)), should_stop=lambda: len(told) > 3,
    )  # fmt: skip
    assert not found.finished
    assert found.open > 0.0
    assert told[-1][0] == found.curve[-1, 0]


def test_refuses():
    robot, case = robot_case("planar")
    with pytest.raises(WorkspaceError, match="varies"):
        PoseBox(np.zeros(6), np.zeros(6))
    with pytest.raises(WorkspaceError, match="cannot change"):
        CertifyTask(CertifiedKind.STATIC, replace(case, lower=case.upper))
    with pytest.raises(WorkspaceError, match="around"):
        CertifyTask(CertifiedKind.INTERFERENCE_FREE, case)
    with pytest.raises(WorkspaceError, match="exit_error"):
        CertifyTask(CertifiedKind.STATIC, case, exit_error=-1.0)
    with pytest.raises(WorkspaceError, match="most_boxes"):
        certify(CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), 0)
