"""What is known of cables over pulleys within a box of poses, and boxes proven with pulleys."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.pulley_kernel import pulley_geometry
from cdpr_drake.workspaces import box_pulleys_kernel as pulleys_kernel
from cdpr_drake.workspaces.box_expansion_kernel import ANCHOR, BEND, EXIT, GAIN, INSIDE, OUTSIDE
from cdpr_drake.workspaces.box_judges import CertifiedKind, CertifyTask
from cdpr_drake.workspaces.box_pulleys_kernel import straight_points
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances
from cdpr_drake.workspaces.certified_boxes import PoseBox, certify
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from cdpr_drake.workspaces.wrench_capacity import closure_margins
from tests.mutants import as_python
from tests.workspaces.test_certificate import check, frame_box
from tests.workspaces.workspace_cases import robot_case

TINY = 1e-12
"""What rounding leaves of a point that is fixed [m]."""


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=0)


def pulleys_at(cables, ends, random, radius=(0.02, 0.01)):
    """The same cables over pulleys at the frame, the platform, or both; axes across the cables."""
    m = cables.count
    along = unit(np.array([[0.0], [0.0], [0.3]]) + cables.p_PB - cables.p_WA)
    r, s = (random.uniform(0.3, 1.0, m) * size for size in radius)
    axes = []
    for sign in (1.0, -1.0):
        across = random.normal(size=(3, m))
        across = unit(across - along * np.sum(across * along, axis=0))
        axes.append(unit(across + sign * random.uniform(-0.6, 0.6, m) * along))
    radii = r if "A" in ends else np.zeros(m), s if "B" in ends else np.zeros(m)
    over = replace(cables, pulley_radius=radii[0], swivel_axis=axes[0])
    return over.over_platform_pulleys(radii[1], axes[1])


def motion(pose):
    R = rotation_from_angles(pose[3:]).matrix()
    return (*R.ravel(), *pose[:3]), R


def broken(functions, ends, first_order, tries, seed=0):
    """Whether a tangent point lies elsewhere than a bound of a box says; only where cables run."""
    random = np.random.default_rng(seed)
    seen = 0
    for _ in range(tries):
        exits = random.uniform(-1.0, 1.0, (3, 1)) + np.array([[1.5], [0.0], [1.0]])
        cables = CableSet.make(exits, random.uniform(-0.2, 0.2, (3, 1)), 1.0)
        cables = pulleys_at(cables, ends, random, (0.3, 0.1))
        rows = cables.packed()
        pose = np.concatenate([random.uniform(-0.5, 0.5, 3), random.uniform(-0.4, 0.4, 3)])
        half = random.uniform(0.0, 0.4, 6) * random.choice([0.0, 0.03, 0.3, 1.0], 6)
        errors = random.choice([0.0, 0.01], 2)
        points, off, turns = np.empty((1, 6)), np.empty((1, 4)), np.empty((1, 3, 3))
        straight_points(rows, errors, points, off)
        if not functions["see_pulleys"](pose, half, rows, errors, first_order, points, off, turns):
            continue
        seen += 1
        _, R_0 = motion(pose)
        middle = pose[:3] + R_0 @ rows[0, 3:6] - rows[0, :3]
        for share in [*random.choice([-1.0, 1.0], (8, 6)), *random.uniform(-1.0, 1.0, (4, 6))]:
            X, R = motion(pose + share * half)
            moved = rows[0].copy()
            for k, size in ((0, errors[0]), (3, errors[1])):
                shift = random.normal(size=3)
                moved[k : k + 3] += size * shift / np.linalg.norm(shift)
            found = np.array(pulley_geometry(X, moved))
            exit_point, anchor = found[2:5], R.T @ found[8:11]
            if off[0, BEND] > 0.0:
                x = np.array(X[9:12]) + R @ moved[3:6] - moved[:3]
                line = x - (exit_point - moved[:3])
                first = middle - (points[0, :3] - rows[0, :3]) + turns[0] @ (x - middle)
                most = off[0, BEND] + off[0, GAIN] * (off[0, EXIT] - errors[0])
                if np.linalg.norm(line - first) > most + TINY:
                    return True
            elif np.linalg.norm(exit_point - points[0, :3]) > off[0, EXIT] + TINY:
                return True
            if np.linalg.norm(anchor - points[0, 3:]) > off[0, ANCHOR] + TINY:
                return True
    assert seen > tries / 4
    return False


COMPILED = {"see_pulleys": pulleys_kernel.see_pulleys}


@pytest.mark.parametrize(
    ("ends", "first_order"), [("A", True), ("A", False), ("B", True), ("AB", True), ("AB", False)]
)
def test_tangent_points_lie_where_a_box_says(ends, first_order):
    assert not broken(COMPILED, ends, first_order, 1500)


def test_the_bounds_shrink_with_the_box_and_the_first_order_is_that():
    """Of second order with first_order, of first order without: the bounds say something."""
    random = np.random.default_rng(1)
    cables = CableSet.make(np.array([[1.0], [0.2], [1.0]]), np.array([[0.1], [0.0], [0.1]]), 1.0)
    told = []
    for ends in ("A", "AB"):
        rows = pulleys_at(cables, ends, random).packed()
        for size in (0.1, 0.01, 0.001):
            points, off, turns = np.empty((1, 6)), np.empty((1, 4)), np.empty((1, 3, 3))
            straight_points(rows, np.zeros(2), points, off)
            half = np.full(6, size)
            assert pulleys_kernel.see_pulleys(
                np.zeros(6), half, rows, np.zeros(2), True, points, off, turns
            )
            told.append(off[0].copy())
    bend = [one[BEND] for one in told[:3]]
    assert bend[0] > 50.0 * bend[1] > 2500.0 * bend[2] > 0.0
    for column in (EXIT, ANCHOR):
        first = [one[column] for one in told[3:]]
        assert first[0] > 5.0 * first[1] > 25.0 * first[2] > 0.0


MUTANTS = [
    ("rho -= nearer + reach + slip", "rho += nearer + reach", ("A", False)),
    ("a = max(r / L, 2.0 * r / rho)", "a = 0.3 * r / L", ("A", False)),
    ("c = max(s / L, 2.0 * s / rho)", "c = 0.3 * s / L", ("B", True)),
    ("off[i, BEND], off[i, EXIT] = bend,", "off[i, BEND], off[i, EXIT] = 0.1 * bend,", ("A", True)),
    ("along, beside = r / L,", "along, beside = -r / L,", ("A", True)),
    ("errors[0] + 2.0 * r, errors", "errors[0] + 0.5 * r, errors", ("A", True)),
    ("+ c * (exit_off + moved_A)", "", ("AB", True)),
    ("exit_off = (1.0 + a) * errors[0] + a * (moved_B", "exit_off = a * (moved_B", ("A", False)),
]


@pytest.mark.parametrize(("old", "new", "where"), MUTANTS)
def test_mutants_of_the_bounds_are_found(old, new, where):
    mutant = as_python(pulleys_kernel, (old, new))
    assert any(broken(mutant, *where, 250, seed) for seed in (0, 1, 2))


@pytest.mark.parametrize(
    ("name", "limits", "ends", "boxes", "least"),
    [
        ("acrobot_large", None, "", 6000, 0.3),
        ("caroca", (30.0, 10_000.0), "", 6000, 0.2),
        ("planar", None, "", 1500, 0.7),
        ("acrobot_fully_constrained", (1.0, 60.0), "AB", 6000, 0.1),
    ],
)
def test_static_boxes_with_pulleys(name, limits, ends, boxes, least):
    """Without ends the robot's own pulleys."""
    robot, case = robot_case(name, limits)
    cables = robot.cable_set()
    if ends:
        cables = pulleys_at(cables.without_pulleys(), ends, np.random.default_rng(3))
    case = replace(case, cables=cables)
    found = certify(CertifyTask(CertifiedKind.STATIC, case), frame_box(robot), boxes)
    check(found, lambda p, R: statically_feasible(case, p, R), least)
    assert found.inside > 0.01


def test_closure_boxes_with_pulleys_and_orientations():
    _, case = robot_case("acrobot_fully_constrained")
    cables = pulleys_at(case.cables, "AB", np.random.default_rng(5))
    case = replace(case, cables=cables)
    middle = np.array([0.1, 0.1, 0.5, 0.0, 0.0, 0.1])
    half = np.array([0.3, 0.25, 0.3, 0.0, 0.0, 0.02])
    task = CertifyTask(CertifiedKind.WRENCH_CLOSURE, case)
    found = certify(task, PoseBox(middle - half, middle + half), 4000)
    check(found, lambda p, R: closure_margins(case, p, R) > 0.0, 0.1)
    assert found.inside > 0.05


@pytest.mark.parametrize("ends", ["A", "AB"])
def test_interference_boxes_with_pulleys(ends):
    robot, case = robot_case("acrobot_large")
    some = CableSet.make(case.cables.p_WA[:, ::2], case.cables.p_PB[:, ::2], 1.0)
    some = pulleys_at(some, ends, np.random.default_rng(2))
    around = Surroundings(
        some, np.full(4, 0.001), box_row([0, 0, 0.035], robot.platform.size)[None],
        obstacles=box_row([0.2, 0.1, 0.7], [0.2, 0.2, 0.2])[None], anchor_free=0.05,
    )  # fmt: skip
    task = CertifyTask(CertifiedKind.INTERFERENCE_FREE, case, around=around, clearance=0.02)
    middle, half = np.array([0.05, 0.0, 0.3, 0, 0, 0]), np.array([0.2, 0.2, 0.2, 0, 0, 0.0])
    found = certify(task, PoseBox(middle - half, middle + half), 6000)
    check(found, lambda p, R: clearances(around, p, R)[:, :4].min(axis=1) > 0.02, 0.1)


def test_no_box_in_which_a_cable_might_not_run_is_inside():
    """Below an exit point a cable does not know to which side its pulley turns."""
    robot, case = robot_case("caroca", (30.0, 10_000.0))
    case = replace(case, cables=robot.cable_set())
    exit_point = case.cables.p_WA[:, 0] - case.cables.p_PB[:, 0]
    lower = exit_point - np.array([0.2, 0.2, 1.5])
    upper = exit_point + np.array([0.2, 0.2, -0.5])
    box = PoseBox(np.append(lower, np.zeros(3)), np.append(upper, np.zeros(3)))
    found = certify(CertifyTask(CertifiedKind.STATIC, case), box, 800)
    below = np.all(
        np.abs(found.poses[:, :2] - exit_point[:2]) <= found.halves[:, :2] + 1e-9, axis=1
    )
    assert np.any(below)
    assert not np.any(found.verdicts[below] == INSIDE)
    assert np.all(np.isin(found.verdicts[below], (0, OUTSIDE)))
