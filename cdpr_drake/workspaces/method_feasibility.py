"""Where a method of tension distribution holds a platform."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.methods import Distributor, method_for
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.workspaces.demanded_wrenches import weight_wrenches
from cdpr_drake.workspaces.static_feasibility import StaticCase, wrench_matrices


def held_by_method(case: StaticCase, positions: Array, rotations: Array, method: str) -> np.ndarray:
    """Whether a method finds tensions within the bounds that balance weight and wrench, (n,).

    Methods that are exact find some wherever `statically_feasible` says that there are; others
    miss them at some poses. Poses at which W is singular, or a cable cannot run, do not count.

    Args:
        case: Platform and load.
        positions: p_WP, shape (n, 3) [m].
        rotations: R_WP, shape (n, 3, 3).
        method: A name of `tensions.METHODS`.

    Raises:
        TensionProblemError: The bounds make no sense, or the method does not take the robot.
    """
    case.check_bounds()
    rows = list(case.rows)
    method_for(method, case.cables.count - len(rows), False)
    W = wrench_matrices(positions, rotations, case.cables)[:, rows]
    loads = weight_wrenches(case, rotations)[:, rows]
    out = np.zeros(len(W), bool)
    distributor = None
    for k in np.flatnonzero(np.all(np.isfinite(W), axis=(1, 2))):
        try:
            if distributor is None:
                problem = TensionProblem(W[k], loads[k], *case.bounds(), row_scale=case.row_scale())
                distributor = Distributor(problem, method)
            out[k] = distributor(W[k], loads[k]).status == TensionStatus.FEASIBLE
        except TensionProblemError:  # W is singular
            continue
    return out
