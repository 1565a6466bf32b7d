"""Tension problems at random and of one robot, for the tests of tension methods."""

import numpy as np

from cdpr_drake.geometry.straight_cables import gravity_wrench, wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.problem import TensionProblem


def load_acrobot():
    """A function that gives the problem of holding `acrobot_large` at a pose."""
    robot = load_robot("acrobot_large")
    A, B = robot.exit_points(), robot.anchor_points()
    weight = robot.platform.mass, robot.center_of_mass()

    def problem(X_WP, lower=0.0, upper=60.0, reference=None):
        W, w = wrench_matrix(X_WP, A, B), gravity_wrench(X_WP, *weight)
        return TensionProblem(W, w, np.full(8, lower), np.full(8, upper), reference)

    return problem


acrobot = load_acrobot()


def random_problem(rng, n, r, lowest=0.0, highest=60.0, reach=0.0):
    """Balanced tensions between the bounds, or out of them by up to a share of the span."""
    m = n + r
    W = rng.normal(size=(n, m))
    t = lowest + (highest - lowest) * rng.uniform(-reach, 1.0 + reach, m)
    reference = rng.uniform(lowest, highest, m)
    return TensionProblem(W, -W @ t, np.full(m, lowest), np.full(m, highest), reference)
