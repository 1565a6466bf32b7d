"""Every method's compiled kernel, called by its address, agrees with the method by name."""

import numpy as np
import pytest

from cdpr_drake.tensions.dispatch_kernel import solve
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape

COMPILED = 1e-11
"""Of tensions up to 60 N: the same code, in which a compiler sums in another order [N]."""


@pytest.mark.parametrize("r", [0, 1, 2, 4])
@pytest.mark.parametrize("name", METHODS)
def test_compiled_choice_is_the_method(name, r):
    method = METHODS[name]
    if not method.takes(r):
        return
    rng = np.random.default_rng(r)
    seen = set()
    for k in range(40):
        W = rng.normal(size=(3, 3 + r))
        wanted = rng.uniform(0.0, 60.0, 3 + r) + (30.0 if k % 4 == 0 else 0.0)
        lower, upper = np.full(3 + r, 2.0), np.full(3 + r, 58.0)
        reference = rng.uniform(2.0, 58.0, 3 + r)
        wrench, row_scale = -W @ wanted, np.array([0.3, 1.0, 1.0])
        problem = TensionProblem(W, wrench, lower, upper, reference, row_scale)
        solution = distribute(problem, name)
        seen.add(solution.status)
        t = np.empty(3 + r)
        code, _ = solve(
            method.compiled(r),
            np.empty(workspace_shape(3, 3 + r)),
            W,
            wrench,
            lower,
            upper,
            reference if method.needs_reference else np.zeros(3 + r),
            row_scale,
            t,
        )
        assert (code == 1) == (solution.status == TensionStatus.FEASIBLE)
        if code == 1 or (code == 0 and method.relaxes) or method.answers:
            np.testing.assert_allclose(t, solution.tensions, rtol=0.0, atol=COMPILED)
        if method.exact:
            assert code == (1 if solution.status == TensionStatus.FEASIBLE else -1)
    assert TensionStatus.FEASIBLE in seen
    assert len(seen) > 1
