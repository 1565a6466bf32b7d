"""A tension method of your own: a kernel and a row of a table; every command knows it then."""

import numba
import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.tensions import METHODS, TensionMethod


@numba.njit
def least_norm(work, W, w, lower, upper, reference, row_scale, t):
    """Writes tensions t with W t = -w, whatever the bounds say; 1: there are some."""
    t[:] = -np.linalg.pinv(W) @ w
    return 1


METHODS["least_norm"] = TensionMethod(
    title="least norm, whatever the bounds say", kernel=least_norm, redundancies=None, exact=False
)
robot = cdpr.load_robot("acrobot_large")
for method in ("least_norm", "barycenter"):
    print(cdpr.solve_tensions(robot, method=method))
