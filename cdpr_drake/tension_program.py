"""Cable tensions that balance a wrench, as a mathematical program."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import MathematicalProgram, Solve

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError

BALANCE_TOLERANCE = 1e-7
"""Largest residual of W t + w that counts as balanced, relative to the larger of |w|, |lower|
and 1 N; the solvers reach 1e-9."""


def least_norm_tensions(W: Array, wrench: Array, lower: Array, upper: Array) -> Array:
    """Tensions of least 2-norm that balance a wrench within bounds.

    min |t|^2 subject to W t + w = 0, lower <= t <= upper.

    Args:
        W: Wrench matrix, shape (n, m), rows (moment, force).
        wrench: External wrench w on the platform about Po, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].

    Returns:
        t, shape (m,) [N].

    Raises:
        InfeasibleTensionError: No tensions within the bounds balance the wrench.

    Source: servoing thesis (1.24)-(1.26); the 2-norm choice is Gazebo thesis 6.3.
    """
    m = W.shape[1]
    program = MathematicalProgram()
    t = program.NewContinuousVariables(m, "t")
    # Scaled by the size of the forces, so that solver tolerances mean the same for every robot.
    scale = max(float(np.linalg.norm(wrench)), float(np.linalg.norm(lower)), 1.0)
    program.AddLinearEqualityConstraint(W, -wrench / scale, t)
    program.AddBoundingBoxConstraint(lower / scale, upper / scale, t)
    program.AddQuadraticCost(2.0 * np.eye(m), np.zeros(m), t, is_convex=True)
    result = Solve(program)
    if result.is_success():
        tensions = np.clip(result.GetSolution(t) * scale, lower, upper)
        tensions = _polish(W, wrench, lower, upper, tensions)
        if np.linalg.norm(W @ tensions + wrench) <= BALANCE_TOLERANCE * scale:
            return tensions
    raise InfeasibleTensionError(
        f"no tensions within {np.min(lower):g}..{np.max(upper):g} N balance the wrench "
        f"{np.array2string(np.asarray(wrench), precision=4)} (N m, N)"
    )


def _polish(W: Array, wrench: Array, lower: Array, upper: Array, t: Array) -> Array:
    """Removes the solver's residual by moving the cables that are off their bounds."""
    margin = 1e-9 * max(1.0, float(np.max(np.abs(t))))
    free = (t > lower + margin) & (t < upper - margin)
    better = t.copy()
    better[free] -= np.linalg.pinv(W[:, free]) @ (W @ t + wrench)
    return better if np.all(better >= lower) and np.all(better <= upper) else t
