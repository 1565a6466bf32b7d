"""Poses that survive the break of any one cable: against HiGHS, and proven in boxes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OUTSIDE
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.workspaces.certified_boxes import PoseBox, certify
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet, weight_wrenches
from cdpr_drake.workspaces.single_failure import (
    break_margins,
    breaks_survived,
    cases_after_breaks,
    survives_breaks,
    without_cable,
)
from cdpr_drake.workspaces.static_feasibility import (
    StaticCase,
    statically_feasible,
    wrench_matrices,
)
from tests.workspaces.test_certificate import drawn
from tests.workspaces.workspace_cases import random_poses, robot_case

SURVIVING = np.array([0.5, 0.5, 0.4])
"""Where in its frame segesta survives breaks, a share along each axis."""

PUSH = SpatialSet(box=np.array([0, 0, 0, 1.0, 1.0, 1.0]))
"""A newton along each axis of W."""

SLIGHT = SpatialSet(box=np.array([0, 0, 0, 0.05, 0.05, 0.05]))
"""What segesta, of which single cables pull 40 N at most, resists near its middle [N]."""


def held_by_highs(case, positions, rotations, broken):
    """The linear program of all cables, the broken one's bounds 0 and 0."""
    rows, (lower, upper) = list(case.rows), case.bounds()
    if broken is not None:
        lower[broken] = upper[broken] = 0.0
    W = wrench_matrices(positions, rotations, case.cables)[:, rows]
    d = -(weight_wrenches(case, rotations) + case.wrench)[:, rows]
    return [
        linprog(np.zeros(W.shape[2]), A_eq=A, b_eq=b, bounds=np.c_[lower, upper]).status == 0
        for A, b in zip(W, d, strict=True)
    ]


def pentagon():
    """A point on five cables from the corners of a regular pentagon of radius 1 m, no weight."""
    turns = np.pi / 2.0 + 2.0 * np.pi * np.arange(5) / 5.0
    corners = np.array([np.cos(turns), np.sin(turns), np.zeros(5)])
    cables = CableSet.make(corners, np.zeros((3, 5)), 1e4)
    case = StaticCase(
        cables, np.full(5, 1e-3), np.full(5, 1e3), 0.0, np.zeros(3), wrench=np.zeros(6), rows=(3, 4)
    )
    return case


@pytest.mark.parametrize("name", ["segesta", "acrobot_large"])
def test_every_subset_holds_as_linear_programs_say(name):
    robot, case = robot_case(name)
    positions, rotations = random_poses(robot, 60, seed=3, turn=0.02)
    if name == "segesta":  # where some survive, as most random poses do not
        positions[::2] = robot.frame.lower + SURVIVING * (robot.frame.upper - robot.frame.lower)
        positions[::2] += np.random.default_rng(4).uniform(-0.05, 0.05, (30, 3))
    every = [None, *range(case.cables.count)]
    theirs = np.array([held_by_highs(case, positions, rotations, one) for one in every])
    found = survives_breaks(case, positions, rotations)
    np.testing.assert_array_equal(found, np.all(theirs, axis=0))
    count = np.where(theirs[0], np.sum(theirs[1:], axis=0), 0)
    np.testing.assert_array_equal(breaks_survived(case, positions, rotations), count)
    assert found.any() == (name == "segesta")
    assert not found.all()
    # At these poses the counts of ACROBOT, with its fitted centre of mass, are 0 and 4 alone.
    assert len(np.unique(count)) > (2 if name == "segesta" else 1)


def test_of_a_pentagon_the_one_of_its_diagonals_survives():
    """Four corners pull to everywhere in their hull: what all five hulls share is the pentagon
    that the diagonals enclose, smaller by the square of the golden ratio."""
    case = pentagon()
    inner = np.cos(0.4 * np.pi)  # distance of a diagonal from the middle
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (4000, 3)) * [1.0, 1.0, 0.0]
    turns = np.pi / 2.0 + 2.0 * np.pi * np.arange(5) / 5.0
    outward = np.array([np.cos(turns), np.sin(turns)])
    depth = inner - np.max(points[:, :2] @ outward, axis=1)  # positive: within all diagonals
    held = survives_breaks(case, points, np.broadcast_to(np.eye(3), (4000, 3, 3)).copy())
    clear = np.abs(depth) > 1e-4  # of the border smallest and largest tensions take a little
    np.testing.assert_array_equal(held[clear], depth[clear] > 0.0)
    box = PoseBox(np.array([-1.0, -1, 0, 0, 0, 0]), np.array([1.0, 1, 0, 0, 0, 0]))
    found = certify(CertifyTask(CertifiedKind.SINGLE_FAILURE, case), box, 6000)
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    area = 2.5 * np.sin(0.4 * np.pi) / golden**4 / 4.0  # of the square of side 2
    assert found.inside < area < found.inside + found.open
    assert found.open < 0.2 * area


def test_margins_and_wrenches_agree_with_verdicts():
    case = pentagon()
    positions = np.random.default_rng(2).uniform(-0.5, 0.5, (400, 3)) * [1.0, 1.0, 0.0]
    rotations = np.broadcast_to(np.eye(3), (400, 3, 3)).copy()
    for required in (None, PUSH):
        held = survives_breaks(case, positions, rotations, required)
        assert held.any()
        assert not held.all()
        margins = break_margins(case, positions, rotations, required)
        clear = np.abs(margins) > 1e-6
        np.testing.assert_array_equal(held[clear], margins[clear] > 0.0)
    pushed = survives_breaks(case, positions, rotations, PUSH)
    assert not np.any(pushed & ~survives_breaks(case, positions, rotations))


def test_a_smallest_tension_can_spoil_what_the_rest_would_hold():
    """With all cables the point must stand, too: one that pulls at least 1 kN takes it away."""
    case = pentagon()
    lower, upper = np.full(5, 1e-3), np.full(5, 10.0)
    lower[0], upper[0] = 1000.0, 2000.0
    tight = replace(case, lower=lower, upper=upper)
    place = np.zeros((1, 3)), np.eye(3)[None]
    assert statically_feasible(without_cable(tight, 0), *place)[0]
    assert not statically_feasible(tight, *place)[0]
    assert not survives_breaks(tight, *place)[0]
    assert survives_breaks(case, *place)[0]
    assert breaks_survived(case, *place)[0] == 5


@pytest.mark.parametrize("required", [SpatialSet(), SLIGHT])
def test_proven_boxes_survive(required):
    _, case = robot_case("segesta")
    pose, half = np.array([0.0, 0.0, 0.62, 0, 0, 0]), np.array([0.08, 0.08, 0.08, 0, 0, 0])
    task = CertifyTask(CertifiedKind.SINGLE_FAILURE, case, required)
    found = certify(task, PoseBox(pose - half, pose + half), 800)
    positions, rotations, verdicts = drawn(found, 1500)
    truth = survives_breaks(case, positions, rotations, required)
    assert np.all(truth[verdicts == INSIDE])
    assert not np.any(truth[verdicts == OUTSIDE])
    assert np.any(verdicts == INSIDE)
    assert np.any(verdicts == OUTSIDE)


def test_a_robot_without_a_cable_to_spare_is_refused():
    _, case = robot_case("nist_robocrane")
    for ask in (cases_after_breaks, lambda case: CertifyTask(CertifiedKind.SINGLE_FAILURE, case)):
        with pytest.raises(WorkspaceError, match=r"6 cables for 6 degrees.*more than 6"):
            ask(case)
    with pytest.raises(WorkspaceError, match="cable: found 6; accepted: 0 to 5"):
        without_cable(case, 6)
