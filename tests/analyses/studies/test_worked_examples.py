"""The theses' examples: programs that agree, and tensions that hold."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.worked_examples import (
    END,
    START,
    TIMES,
    by_conditions,
    by_printed_coefficients,
    end_error,
    held_problems,
    holds,
)
from cdpr_drake.tensions.methods import distribute

ROUNDING = 1e-9
"""Of polynomials in a time up to 100 s [m]."""


def test_the_second_program_is_the_polynomial_of_the_conditions():
    motion = by_conditions()
    s = TIMES / TIMES[-1]
    blend = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None]
    np.testing.assert_allclose(motion[0], START + blend * (END - START), atol=ROUNDING)
    assert end_error(motion) < ROUNDING


def test_the_printed_coefficients_lead_elsewhere():
    # 10 + 15 + 6 times the way, in the place of 10 - 15 + 6.
    motion = by_printed_coefficients()
    np.testing.assert_allclose(motion[0][-1], START + 31.0 * (END - START), atol=ROUNDING)
    assert end_error(motion) == pytest.approx(90.0)


def test_tensions_hold_that_balance_within_the_limits():
    problem = held_problems((2, 2, 2))[0]
    t = distribute(problem, "barycenter").tensions
    assert holds(problem, t)
    assert not holds(problem, t + 1e-3)
    assert not holds(problem, t - 2.0 * problem.upper)
