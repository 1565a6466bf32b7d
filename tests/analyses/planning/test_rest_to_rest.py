"""Direct collocation through the differentiable plant: a plan that a simulation follows."""

import numpy as np
import pytest

from cdpr_drake.analyses.planning.rest_to_rest import example_robot, plan_rest_to_rest
from cdpr_drake.errors import InfeasibleTensionError

START, GOAL = (-0.1, 0.1, 0.0), (0.1, -0.05, 0.2)

FOLLOWED = 1e-3
"""Where the simulated platform ends off the goal [m]: 0.2 mm with 13 samples, and by the fourth
power of their number less with more."""


def test_a_plan_ends_at_rest_where_the_straight_way_swings():
    plan = plan_rest_to_rest(example_robot(), START, GOAL, 0.6, 13)
    assert plan.success
    end = plan.simulated_end(plan.planned)
    assert np.linalg.norm(end[:2] - plan.goal[:2]) < FOLLOWED
    np.testing.assert_allclose(end[6:], plan.goal[6:], atol=1e-6)  # as much cable as planned
    assert plan.swing(plan.planned) < 0.2 * plan.swing(plan.straight)


def test_ends_that_nothing_holds_are_refused():
    with pytest.raises(InfeasibleTensionError, match=r"within 10\.\.11 N balance each other"):
        plan_rest_to_rest(example_robot(), (-0.4, 0.4, 0.0), GOAL, 0.6, 3, bounds=(10.0, 11.0))
