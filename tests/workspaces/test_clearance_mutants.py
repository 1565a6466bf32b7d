"""Proofs of clearance need their terms: without one of these they prove what is not so."""

import numpy as np
import pytest

from cdpr_drake.workspaces import (
    box_clearance_kernel,
)
from cdpr_drake.workspaces import (
    box_pair_clearance_kernel as pair_clearance_kernel,
)
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_distance, segments_distance
from cdpr_drake.workspaces.cable_interference import box_row
from tests.workspaces.mutants import as_python

EXTENT = 5.0
TRIES = 1500
MOVES = 24


def moves(random, half):
    """Positions of a box, a half of them its corners, shape (n, 3)."""
    found = random.uniform(-1.0, 1.0, (MOVES, 3))
    found[::2] = np.sign(found[::2])
    return found * half


def spaces(count):
    return [np.zeros(3), np.zeros((3, 3)), *np.zeros((count, 3))]


def off(random, size):
    """A shift of a point by as much as it may be off."""
    d = random.normal(size=3)
    return size * d / np.linalg.norm(d)


def pairs_broken(functions, random):
    """Whether two cables break a promise about them."""
    A, B, C, D = random.uniform(-1.0, 1.0, (4, 3))
    near = random.normal(size=3) * 0.02
    if random.random() < 0.4:  # nearly touching
        x, y = random.uniform(0.2, 0.8, 2)
        D = C + (A + x * (B - A) + near - C) / y
    elif random.random() < 0.5:  # one ends near where the other begins
        D = A + 3.0 * near
    half = random.uniform(0.0, 0.3, 3) * random.choice([0.01, 0.1, 1.0], 3)
    apart, error = random.choice([0.002, 0.05]), random.choice([0.0, 0.01])
    verdict, _ = functions["judge_pair"](A, B, C, D, half, apart, error, EXTENT, *spaces(2))
    if verdict == OPEN:
        return False
    for d in moves(random, half):
        gap = segments_distance(A + off(random, error), B + d, C, D + d)
        if (gap > apart) != (verdict == INSIDE):
            return True
    return False


def boxes_broken(functions, random):
    """Whether a cable and a box break a promise about them."""
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0] if random.random() < 0.5 else np.eye(3)
    box = box_row(random.uniform(-0.3, 0.3, 3), random.uniform(0.1, 0.6, 3), turn)
    apex, end = random.uniform(-1.0, 1.0, (2, 3))
    half = random.uniform(0.0, 0.3, 3) * random.choice([0.01, 0.1, 1.0], 3)
    free, apart = random.choice([0.0, 0.2, 0.6]), random.choice([0.001, 0.05])
    sign, errors = random.choice([-1.0, 1.0]), random.choice([0.0, 0.02], 2)
    verdict, _ = functions["judge_box"](
        apex, end, sign, half, box, free, apart, *errors, EXTENT, *spaces(3)
    )
    if verdict == OPEN:
        return False
    for d in moves(random, half):
        p, q = apex + off(random, errors[0]), end + sign * d + off(random, errors[1])
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
    (pair_clearance_kernel, "value -= half[k] * abs(sign * n[k] + dot(nk[k], Q))", "pass"),
    (pair_clearance_kernel, "need = (apart + error) * longest", "need = apart * longest"),
    (pair_clearance_kernel, "sign = (0.0, 0.0, -1.0, 1.0)[corner]", "sign = 0.0"),
    (pair_clearance_kernel, "far += step", "pass"),
    (pair_clearance_kernel, "far = np.sqrt(dot(n, n)) + split * size", "far = np.sqrt(dot(n, n))"),
    (box_clearance_kernel, "moved += share * half[k] * abs(axis[k])", "pass"),
    (
        box_clearance_kernel,
        "swing = free * largest_swing(n, q, half, shortest, change)",
        "swing = 0.0",
    ),
    (
        box_clearance_kernel,
        "return (first + 2.0 * errors) / length * (1.0 + ROUNDING) + second + ROUNDING",
        "return 0.0",
    ),
    (box_clearance_kernel, "Q[k] -= side * box[3 * k + a]", "pass"),
]


@pytest.mark.parametrize(("module", "old", "new"), MUTANTS)
def test_mutants_of_the_proofs_are_found(module, old, new):
    assert broken(functions_of((module, old, new)))
