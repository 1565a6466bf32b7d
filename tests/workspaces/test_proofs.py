"""Proofs of boxes keep their promises at random poses and corners of random boxes."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.pulley_kernel import pulley_geometry
from cdpr_drake.proofs import (
    box_clearance_kernel,
    box_collision_kernel,
    box_expansion_kernel,
    box_inside_kernel,
    box_outside_kernel,
    box_pair_clearance_kernel,
    box_pulleys_kernel,
)
from cdpr_drake.proofs.box_expansion_kernel import (
    ANCHOR,
    BEND,
    EXIT,
    GAIN,
    INSIDE,
    OPEN,
    turn_axes,
)
from cdpr_drake.proofs.box_judges import CLOSURE_SHARE
from cdpr_drake.proofs.box_pulleys_kernel import straight_points
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_distance, segments_distance
from cdpr_drake.workspaces.cable_interference import box_row
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, closure_margins
from tests.mutants import as_python
from tests.workspaces.workspace_cases import pulleys_at, robot_case, rotations_of, unit

TINY = 1e-12  # what rounding leaves of a point that is fixed [m]


def functions_of(modules, *changes):
    """All functions of modules; a change says its module, old and new words."""
    functions = {}
    for module in modules:
        mine = [change[1:] for change in changes if change[0] is module]
        functions |= as_python(module, *mine) if mine else vars(module)
    return functions


def shares(random, count, numbers=6):
    """Of half widths, a half of them corners, shape (count, numbers)."""
    share = random.uniform(-1.0, 1.0, (count, numbers))
    share[::2] = np.sign(share[::2])
    return share


def off(random, size, shape=3):
    """A shift of a point by as much as it may be off."""
    return size * unit(random.normal(size=shape))


# Clearances of cables from each other and from boxes.

CLEARANCES = (box_pair_clearance_kernel, box_clearance_kernel)
COLLISIONS = (box_collision_kernel,)
PULLEYS = (box_pulleys_kernel,)
WRENCHES = (box_inside_kernel, box_outside_kernel, box_expansion_kernel)
EXTENT = 5.0


def spaces(*shapes):
    return [np.zeros(shape) for shape in shapes]


def drawn_half(random):
    """Half widths of a pose, of a half of them without turns, and how many numbers vary."""
    half = random.uniform(0.0, 0.3, 6) * random.choice([0.01, 0.1, 1.0], 6)
    numbers = int(random.choice([3, 6]))
    half[numbers:] = 0.0
    half[3:] *= random.choice([0.0, 1.0], 3)
    if numbers > 3 and random.random() < 0.7:  # hardly anything but turns
        half[:3] *= 0.001
    return half, numbers


def turned_moves(angles, arm, sign):
    """How sign (p + R b) follows a pose, b seen as an arm in W, shape (6, 3)."""
    R, axes = np.zeros((3, 3)), np.zeros((3, 3))
    turn_axes(angles, R, axes)
    return sign * np.concatenate([np.eye(3), np.cross(axes, arm)])


def pair_broken(functions, random):
    """True if two cables break a promise about them."""
    A, B, C, D = random.uniform(-1.0, 1.0, (4, 3))
    near = random.normal(size=3) * 0.02
    if random.random() < 0.4:  # nearly touching
        x, y = random.uniform(0.2, 0.8, 2)
        D = C + (A + x * (B - A) + near - C) / y
    elif random.random() < 0.5:  # one ends near where the other begins
        D = A + 3.0 * near
    half, numbers = drawn_half(random)
    middle = 0.5 * (B + D) + random.normal(size=3) * 0.1
    angles, arms = random.uniform(-1.0, 1.0, 3), (B - middle, D - middle)
    turned = [turned_moves(angles, arm, 1.0) for arm in arms]
    bend = 0.5 * np.sum(half[3:]) ** 2 * sum(np.linalg.norm(arm) for arm in arms)
    apart, error = random.choice([0.002, 0.05]), random.choice([0.0, 0.01])
    verdict, _ = functions["judge_pair"](
        A, B, C, D, *turned, half, numbers, apart, error + bend, EXTENT,
        *spaces(3, (6, 3), 3, (6, 3), 6),
    )  # fmt: skip
    if verdict == OPEN:
        return False
    R = rotation_from_angles(angles).matrix()
    for d in shares(random, 24) * half:
        turn = rotation_from_angles(angles + d[3:]).matrix() @ R.T
        ends = [middle + d[:3] + turn @ arm for arm in arms]
        gap = segments_distance(A + off(random, error), ends[0], C, ends[1])
        if (gap > apart) != (verdict == INSIDE):
            return True
    return False


def box_broken(functions, random):
    """True if a cable and a box break a promise about them."""
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0] if random.random() < 0.5 else np.eye(3)
    box = box_row(random.uniform(-0.3, 0.3, 3), random.uniform(0.1, 0.6, 3), turn)
    apex, end = random.uniform(-1.0, 1.0, (2, 3))
    half, numbers = drawn_half(random)
    free, apart = random.choice([0.0, 0.2, 0.6]), random.choice([0.001, 0.05])
    sign, errors = random.choice([-1.0, 1.0]), random.choice([0.0, 0.02], 2)
    angles, arm = random.uniform(-1.0, 1.0, 3), random.normal(size=3)
    bend = 0.5 * np.sum(half[3:]) ** 2 * np.linalg.norm(arm)
    verdict, _ = functions["judge_box"](
        apex, end, turned_moves(angles, arm, sign), half, numbers, box, free, apart, *errors,
        bend, EXTENT, *spaces(3, (6, 3), 3, 3, 6, 6),
    )  # fmt: skip
    if verdict == OPEN:
        return False
    R = rotation_from_angles(angles).matrix()
    for d in shares(random, 24) * half:
        rest = rotation_from_angles(angles + d[3:]).matrix() @ R.T @ arm - arm
        p, q = apex + off(random, errors[0]), end + sign * (d[:3] + rest) + off(random, errors[1])
        length = np.linalg.norm(q - p)
        start = p + (q - p) * free / length
        gap = segment_box_distance(start, q, box) if length > free else np.inf
        if (gap > apart) != (verdict == INSIDE):
            return True
    return False


def clearances_broken(functions):
    random = np.random.default_rng(0)
    return any(pair_broken(functions, random) or box_broken(functions, random) for _ in range(1500))


# Collisions of convex shapes.


def collisions_broken(functions):
    """True if the judge breaks a promise on random boxes about random shapes."""
    random = np.random.default_rng(0)
    body = ConvexShape.box_at([0, 0, 0.05], [0.2, 0.3, 0.1])
    for _ in range(1500):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        other = ConvexShape.box_at(np.zeros(3), random.uniform(0.05, 0.3, 3), turn)
        other = replace(other, radius=random.choice([0.0, 0.05]))
        pose = np.concatenate([random.normal(size=3) * 0.15, random.uniform(-0.3, 0.3, 3)])
        half = random.uniform(0.0, 0.1, 6) * random.choice([0.0, 0.3, 1.0], 6)
        half *= random.choice([0.1, 1.0])
        verdict = np.empty(1, np.int64)
        functions["judge_collisions"](
            0, 1, pose[None], half[None], *packed([body]), *packed([other]), 0.01,
            convex_work(64, 8), verdict, np.empty((1, 6)),
        )  # fmt: skip
        if verdict[0] == OPEN:
            continue
        for at in pose + shares(random, 12) * half:
            R = RotationMatrix.MakeXRotation(at[3]) @ RotationMatrix.MakeYRotation(at[4])
            X = RigidTransform(R @ RotationMatrix.MakeZRotation(at[5]), at[:3])
            if (body.moved(X).distance(other)[0] > 0.01) != (verdict[0] == INSIDE):
                return True
    return False


# Where cables over pulleys run.


def pulleys_broken(functions, ends="A", first_order=True):
    """True if a tangent point lies elsewhere than a bound of a box says, where cables run."""
    random = np.random.default_rng(0)
    count = 0
    for _ in range(400):
        exits = random.uniform(-1.0, 1.0, (3, 1)) + np.array([[1.5], [0.0], [1.0]])
        cables = CableSet.make(exits, random.uniform(-0.2, 0.2, (3, 1)), 1.0)
        rows = pulleys_at(cables, ends, random, (0.3, 0.1)).packed()
        pose = np.concatenate([random.uniform(-0.5, 0.5, 3), random.uniform(-0.4, 0.4, 3)])
        half = random.uniform(0.0, 0.4, 6) * random.choice([0.0, 0.03, 0.3, 1.0], 6)
        errors = random.choice([0.0, 0.01], 2)
        points, known, turns = np.empty((1, 6)), np.empty((1, 4)), np.empty((1, 3, 3))
        straight_points(rows, errors, points, known)
        box = (pose, half, rows, errors, first_order)
        if not functions["see_pulleys"](*box, points, known, turns):
            continue
        count += 1
        R = rotation_from_angles(pose[3:]).matrix()
        middle = pose[:3] + R @ rows[0, 3:6] - rows[0, :3]
        for share in [*random.choice([-1.0, 1.0], (8, 6)), *random.uniform(-1.0, 1.0, (4, 6))]:
            at = pose + share * half
            R = rotation_from_angles(at[3:]).matrix()
            moved = rows[0].copy()
            moved[:3] += off(random, errors[0])
            moved[3:6] += off(random, errors[1])
            tangents = np.array(pulley_geometry((*R.ravel(), *at[:3]), moved))
            exit_point, anchor = tangents[2:5], R.T @ tangents[8:11]
            if known[0, BEND] > 0.0:
                x = at[:3] + R @ moved[3:6] - moved[:3]
                line = x - (exit_point - moved[:3])
                first = middle - (points[0, :3] - rows[0, :3]) + turns[0] @ (x - middle)
                most = known[0, BEND] + known[0, GAIN] * (known[0, EXIT] - errors[0])
                if np.linalg.norm(line - first) > most + TINY:
                    return True
            elif np.linalg.norm(exit_point - points[0, :3]) > known[0, EXIT] + TINY:
                return True
            if np.linalg.norm(anchor - points[0, 3:]) > known[0, ANCHOR] + TINY:
                return True
    assert count > 100
    return False


@pytest.mark.parametrize(
    ("ends", "first_order"), [("A", True), ("A", False), ("B", True), ("AB", True), ("AB", False)]
)
def test_tangent_points_lie_where_a_box_says(ends, first_order):
    assert not pulleys_broken(vars(box_pulleys_kernel), ends, first_order)


def test_bounds_of_tangent_points_shrink_with_the_box_and_the_first_order_is_that():
    """Of second order with first_order, of first order without: the bounds say something."""
    random = np.random.default_rng(1)
    cables = CableSet.make(np.array([[1.0], [0.2], [1.0]]), np.array([[0.1], [0.0], [0.1]]), 1.0)
    bounds = []
    for ends in ("A", "AB"):
        rows = pulleys_at(cables, ends, random).packed()
        for size in (0.1, 0.01, 0.001):
            points, known, turns = np.empty((1, 6)), np.empty((1, 4)), np.empty((1, 3, 3))
            straight_points(rows, np.zeros(2), points, known)
            box = (np.zeros(6), np.full(6, size), rows, np.zeros(2), True)
            assert box_pulleys_kernel.see_pulleys(*box, points, known, turns)
            bounds.append(known[0])
    bend = [row[BEND] for row in bounds[:3]]
    assert bend[0] > 50.0 * bend[1] > 2500.0 * bend[2] > 0.0
    for column in (EXIT, ANCHOR):
        first = [row[column] for row in bounds[3:]]
        assert first[0] > 5.0 * first[1] > 25.0 * first[2] > 0.0


# Wrenches that cables can balance.

SETTINGS = {
    "exact": ((0.0, 0.0), False),
    "exits": ((0.02, 0.0), False),
    "anchors": ((0.0, 0.01), False),
    "closure": ((0.0, 0.0), True),
    "closure, exits": ((0.02, 0.0), True),
}
"""By how much exit and anchor points may be off [m], and whether closure is asked."""


def wrench_case():
    _, case = robot_case("planar", (1.0, 12.0))
    return replace(case, wrench=np.array([0, 0, 0.1, 2.0, 1.0, 0]))


def proven(functions, case, errors, closure, pose, half):
    """1 if a box of poses of a planar robot is proven inside, -1 outside, 0 neither."""
    n, m = 3, 4
    points = np.vstack([case.cables.p_WA, case.cables.p_PB]).T
    g, gk = np.empty((n, m)), np.empty((6, n, m))
    lengths, rest = np.empty((7, m)), np.empty((3 + n, m))
    scale, rows = case.row_scale(), np.array(case.rows)
    known, turns = np.tile([*errors, 0.0, 1.0], (m, 1)), np.empty((m, 3, 3))
    expand = functions["expand"]
    if not expand(pose, half, points, rows, scale, known, turns, g, gk, lengths, rest):
        return 0
    d, d_rest = np.zeros((7, n)), np.zeros(n)
    lower, upper = case.lower, case.upper
    if closure:
        lower, upper = np.full(m, CLOSURE_SHARE), np.ones(m)
    else:
        d[0] = -case.wrench[rows] / scale
    rests = (half, g, gk, lengths, rest, d, d_rest, lower, upper)
    work = np.empty(workspace_shape(n, m))
    if functions["proves_inside"](*rests, closure, np.zeros(6), work, np.empty(6)):
        return 1
    W = g / lengths[0]
    normals = np.array([np.cross(W[:, i], W[:, j]) for i in range(4) for j in range(i)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.concatenate([normals, -normals])
    q = normals @ W
    if closure:
        cone = normals[np.all(q <= 1e-9, axis=1)]
        if not len(cone):
            return 0
        c, ck = cone.sum(0), np.empty((6, n))
        functions["central_direction"](W, c)
        functions["follow_cone"](c, half, W, gk, lengths, ck)
        return -int(functions["proves_open_cone"](c, ck, half, g, gk, rest, np.empty(6)))
    room = np.maximum(q * lower, q * upper).sum(1) - normals @ d[0]
    worst = int(np.argmin(room))
    if room[worst] >= 0.0:
        return 0
    return -int(functions["proves_outside"](normals[worst].copy(), *rests, np.empty(6)))


def wrenches_broken(functions, setting="exact"):
    """True if a proven box has a pose, with points that are off, where it is not so.

    At each of 60 poses the largest box is looked at that the proof accepts.
    """
    (errors, closure), case = SETTINGS[setting], wrench_case()
    errors, random = np.array(errors), np.random.default_rng(0)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    for _ in range(60):
        pose = np.zeros(6)
        pose[:2], pose[2] = random.uniform(-0.45, 0.45, 2), 0.3
        pose[5] = random.uniform(-0.5, 0.5)
        shape = np.array([0.2, 0.2, 0, 0, 0, 0.5]) * random.choice([0.05, 0.3, 1.0], 6)
        for scale in np.geomspace(2.0, 0.005, 28):
            verdict = proven(functions, case, errors, closure, pose, scale * shape)
            if verdict:
                break
        else:
            continue
        moves = np.zeros((40, 6))
        moves[:, [0, 1, 5]] = np.vstack([signs, random.uniform(-1, 1, (32, 3))])
        poses = pose + moves * scale * shape
        at = poses[:, :3], rotations_of(poses[:, 3:])
        for _ in range(12 if errors.any() else 1):
            shifts = random.normal(size=(2, 3, 4))
            shifts[:, 2] = 0.0
            shifts *= errors[:, None, None] / np.linalg.norm(shifts, axis=1)[:, None]
            cables = case.cables
            cables = CableSet.make(cables.p_WA + shifts[0], cables.p_PB + shifts[1], 1.0)
            moved = replace(case, cables=cables)
            margins = closure_margins if closure else lambda *a: capacity_margins(*a).margins
            if np.any((margins(moved, *at) > 0.0) != (verdict > 0)):
                return True
    return False


@pytest.mark.parametrize("setting", SETTINGS)
def test_proofs_of_wrenches_are_not_broken(setting):
    assert not wrenches_broken(functions_of(WRENCHES), setting)


# All of these.


@pytest.mark.parametrize(
    ("broken", "modules"), [(clearances_broken, CLEARANCES), (collisions_broken, COLLISIONS)]
)
def test_proofs_of_distances_are_not_broken(broken, modules):
    assert not broken(functions_of(modules))


@pytest.mark.parametrize(
    ("broken", "modules", "old", "new"),
    [
        (clearances_broken, CLEARANCES, "(apart + error) * longest", "apart * longest"),
        (collisions_broken, COLLISIONS, "body_radii[b] + radii[o]", "body_radii[b]"),
        (pulleys_broken, PULLEYS, "along, beside = r / L,", "along, beside = -r / L,"),
        (wrenches_broken, WRENCHES, "(rho[k] + more)", "0.0"),
    ],
)
def test_these_checks_see_a_term_that_is_missing(broken, modules, old, new):
    """Of the first module; `python -m tests.mutants` tries more of them."""
    assert broken(functions_of(modules, (modules[0], old, new)))
