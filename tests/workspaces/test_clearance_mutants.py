"""Proofs of clearance need their terms: without one of these they prove what is not so."""

import numpy as np
import pytest

from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.workspaces import (
    box_clearance_kernel,
)
from cdpr_drake.workspaces import (
    box_pair_clearance_kernel as pair_clearance_kernel,
)
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, turn_axes
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_distance, segments_distance
from cdpr_drake.workspaces.cable_interference import box_row
from tests.mutants import as_python

EXTENT = 5.0
TRIES = 3000
MOVES = 24


def moves(random, half):
    """Poses of a box, a half of them its corners, shape (n, 6)."""
    found = random.uniform(-1.0, 1.0, (MOVES, 6))
    found[::2] = np.sign(found[::2])
    return found * half


def spaces(*shapes):
    return [np.zeros(shape) for shape in shapes]


def off(random, size):
    """A shift of a point by as much as it may be off."""
    d = random.normal(size=3)
    return size * d / np.linalg.norm(d)


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


def pairs_broken(functions, random):
    """Whether two cables break a promise about them."""
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
    for d in moves(random, half):
        turn = rotation_from_angles(angles + d[3:]).matrix() @ R.T
        ends = [middle + d[:3] + turn @ arm for arm in arms]
        gap = segments_distance(A + off(random, error), ends[0], C, ends[1])
        if (gap > apart) != (verdict == INSIDE):
            return True
    return False


def boxes_broken(functions, random):
    """Whether a cable and a box break a promise about them."""
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0] if random.random() < 0.5 else np.eye(3)
    box = box_row(random.uniform(-0.3, 0.3, 3), random.uniform(0.1, 0.6, 3), turn)
    apex, end = random.uniform(-1.0, 1.0, (2, 3))
    half, numbers = drawn_half(random)
    free, apart = random.choice([0.0, 0.2, 0.6]), random.choice([0.001, 0.05])
    sign, errors = random.choice([-1.0, 1.0]), random.choice([0.0, 0.02], 2)
    angles, arm = random.uniform(-1.0, 1.0, 3), random.normal(size=3)
    s = np.sum(half[3:])
    verdict, _ = functions["judge_box"](
        apex, end, turned_moves(angles, arm, sign), half, numbers, box, free, apart, *errors,
        0.5 * s * s * np.linalg.norm(arm), EXTENT, *spaces(3, (6, 3), 3, 3, 6, 6),
    )  # fmt: skip
    if verdict == OPEN:
        return False
    R = rotation_from_angles(angles).matrix()
    for d in moves(random, half):
        rest = rotation_from_angles(angles + d[3:]).matrix() @ R.T @ arm - arm
        p, q = apex + off(random, errors[0]), end + sign * (d[:3] + rest) + off(random, errors[1])
        length = np.linalg.norm(q - p)
        start = p + (q - p) * free / length
        gap = segment_box_distance(start, q, box) if length > free else np.inf
        if (gap > apart) != (verdict == INSIDE):
            return True
    return False


def broken(functions):
    random = np.random.default_rng(0)
    return any(
        pairs_broken(functions, random) or boxes_broken(functions, random) for _ in range(TRIES)
    )


def functions_of(*changes):
    """The two judges; a change says its module, old and new words."""
    found = {}
    for module in (pair_clearance_kernel, box_clearance_kernel):
        mine = [change[1:] for change in changes if change[0] is module]
        found |= as_python(module, *mine) if mine else vars(module)
    return found


def test_the_proofs_are_not_broken():
    assert not broken(functions_of())


MUTANTS = [
    (
        pair_clearance_kernel,
        "value -= half[k] * abs(dot(n, moves[k]) + dot(nk[k], Q))",
        "value -= half[k] * abs(dot(n, moves[k]) + dot(nk[k], Q)) if k < 3 else 0.0",
    ),
    (
        pair_clearance_kernel,
        "value -= half[k] * abs(dot(n, moves[k]) + dot(nk[k], Q))",
        "value -= half[k] * abs(dot(n, moves[k]) + dot(nk[k], Q)) if k > 2 else 0.0",
    ),
    (pair_clearance_kernel, "need = (apart + error) * longest", "need = apart * longest"),
    (pair_clearance_kernel, "still = corner == 0", "still = True or corner == 0"),
    (pair_clearance_kernel, "far += step", "pass"),
    (pair_clearance_kernel, "far = np.sqrt(dot(n, n)) + split * size", "far = np.sqrt(dot(n, n))"),
    (
        box_clearance_kernel,
        "moved += share * half[k] * abs(dot(axis, moves[k]))",
        "moved += share * half[k] * abs(dot(axis, moves[k])) if k < 3 else 0.0",
    ),
    (box_clearance_kernel, "moved += share * half[k] * abs(dot(axis, moves[k]))", "pass"),
    (
        box_clearance_kernel,
        "most = free * largest_swing(n, q, moves, half, numbers, shortest, change, size)",
        "most = 0.0",
    ),
    (
        box_clearance_kernel,
        "return (first + 2.0 * errors) / length * (1.0 + ROUNDING) + second + ROUNDING",
        "return 0.0",
    ),
    (box_clearance_kernel, "Q[k] -= to * box[3 * k + a]", "pass"),
    (box_clearance_kernel, "size += swing(moves, half, numbers)", "pass"),
]


@pytest.mark.parametrize(("module", "old", "new"), MUTANTS)
def test_mutants_of_the_proofs_are_found(module, old, new):
    assert broken(functions_of((module, old, new)))
