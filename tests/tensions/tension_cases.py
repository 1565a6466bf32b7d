"""Tension problems at random and of robots that ship, and oracles for them."""

from functools import cache

import numpy as np
from hypothesis import strategies as st
from scipy.optimize import linprog

from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.problem import TensionProblem, writable
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape

LIMITS = {"acrobot_large": (0.0, 60.0), "caroca": (30.0, 3000.0)}  # [N]
seeds = st.integers(0, 2**32 - 1)


@cache
def numbers_of(name):
    robot = load_robot(name)
    weight = robot.platform.mass, robot.center_of_mass()
    return robot.exit_points(), robot.anchor_points(), weight, robot.frame


def weight(name, X_WP, factor=1.0):
    A, B, (mass, p_PCo), _ = numbers_of(name)
    return wrench_matrix(X_WP, A, B), gravity_wrench(X_WP, factor * mass, p_PCo)


def acrobot(X_WP, lower=0.0, upper=60.0, reference=None, factor=1.0):
    """The problem of holding `acrobot_large`, or a multiple of its mass, at a pose."""
    W, w = weight("acrobot_large", X_WP, factor)
    return TensionProblem(W, w, np.full(8, lower), np.full(8, upper), reference)


def weights(name, count, seed=0):
    """Wrench matrices and weights of a robot at random poses in its frame."""
    frame, rng = numbers_of(name)[3], np.random.default_rng(seed)
    center, half = (frame.lower + frame.upper) / 2.0, (frame.upper - frame.lower) / 2.0
    places = (rng.uniform(-0.95, 0.95, 3) for _ in range(count))
    poses = (pose_from_angles(center + half * p, rng.uniform(-0.5, 0.5, 3)) for p in places)
    W, w = zip(*(weight(name, X_WP) for X_WP in poses), strict=True)
    return np.array(W), np.array(w)


def random_problem(rng, n, r, lowest=0.0, highest=60.0, reach=0.0):
    """Balanced by tensions between the bounds, or out of them by up to a share of the range."""
    m = n + r
    W = rng.normal(size=(n, m))
    t = lowest + (highest - lowest) * rng.uniform(-reach, 1.0 + reach, m)
    reference = rng.uniform(lowest, highest, m)
    return TensionProblem(W, -W @ t, np.full(m, lowest), np.full(m, highest), reference)


@st.composite
def problems(draw, redundancies=(0, 1, 2, 2, 3, 5), shapes=("normal", "whole", "twins", "levers")):
    """Problems of any size, degenerate ones among them, with and without tensions."""
    n = draw(st.integers(1, 6))
    m = n + draw(st.sampled_from(redundancies))
    rng = np.random.default_rng(draw(seeds))
    shape = draw(st.sampled_from(shapes))
    W = rng.integers(-2, 3, (n, m)).astype(float) if shape == "whole" else rng.normal(size=(n, m))
    if shape == "twins" and m > n:
        W[:, -1] = W[:, 0]
    if shape == "levers":
        W[0] *= 1e-2
    largest = draw(st.sampled_from([1.0, 60.0, 3000.0]))
    lower = largest * rng.uniform(0.0, draw(st.sampled_from([0.0, 0.3])), m)
    upper = lower + largest * rng.uniform(draw(st.sampled_from([0.1, 1.0])), 1.0, m)
    if draw(st.booleans()):
        fixed = rng.random(m) < 0.2
        upper[fixed] = lower[fixed]
    reach = draw(st.sampled_from([0.0, 0.2, 0.5]))
    t = lower + (upper - lower) * rng.uniform(-reach, 1.0 + reach, m)
    reference, scale = rng.uniform(0.0, largest, m), 10.0 ** rng.uniform(-1.5, 0.0, n)
    try:
        return TensionProblem(W, -W @ t, lower, upper, reference, scale)
    except TensionProblemError:  # whole numbers may be singular
        W = np.eye(n, m)
        return TensionProblem(W, -W @ t, lower, upper, reference, scale)


def by_highs(problem, cost, rows=None, high=None, bounded=True):
    """Least cost' (t, s) with W t + w = 0, rows (t, s) <= high, and the bounds of the problem."""
    n, m = problem.W.shape
    bounds = zip(problem.lower, problem.upper, strict=True) if bounded else [(None, None)] * m
    return linprog(
        cost, A_ub=rows, b_ub=high, A_eq=np.hstack([problem.W, np.zeros((n, 1))]),
        b_eq=-problem.wrench, bounds=[*bounds, (None, None)], method="highs",
    )  # fmt: skip


def largest_margin(problem):
    """Largest common margin to all bounds [N]; negative: nothing is feasible."""
    m = problem.W.shape[1]
    rows = np.block([[-np.eye(m), np.ones((m, 1))], [np.eye(m), np.ones((m, 1))]])
    high = np.concatenate([-problem.lower, problem.upper])
    result = by_highs(problem, np.append(np.zeros(m), -1.0), rows, high, bounded=False)
    assert result.success
    return -result.fun


def numbers(problem):
    """W, w, lower and upper of a problem, as kernels take them."""
    return [writable(a) for a in (problem.W, problem.wrench, problem.lower, problem.upper)]


def run(kernel, problem, *more):
    """Code and tensions of a kernel of `METHODS`, or of one that takes more arguments."""
    t = np.full(problem.W.shape[1], np.nan)
    if more:
        return kernel(*numbers(problem), *more, t), t
    work = np.full(workspace_shape(*problem.W.shape), np.nan)
    scale = writable(problem.scale_of_rows)
    return kernel(work, *numbers(problem), np.zeros(len(t)), scale, t), t
