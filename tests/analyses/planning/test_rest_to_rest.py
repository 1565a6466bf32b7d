"""Rest to rest without swing on the simulated robot: shaped, shot, and by direct collocation."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.input_shaping import plan_shaped_rest, simulate_swing
from cdpr_drake.analyses.planning.rest_to_rest import example_robot, plan_rest_to_rest
from cdpr_drake.analyses.planning.shooting import plan_shot_rest
from cdpr_drake.errors import InfeasibleTensionError, PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.settings import CableSettings


def hanging():
    """The suspended robot on four of its eight cables: six degrees of freedom, it swings."""
    robot = load_robot("acrobot_large")
    robot.cables = [robot.cables[k] for k in (0, 2, 4, 6)]
    return robot


CASES = {
    "rubber": (example_robot, [-0.1, 0.05, 0.3], [0.15, -0.05, 0.3], 0.45, (10.0, 60.0)),
    "steel": (lambda: load_robot("planar"), [0, 0, 0.3], [0.005, 0, 0.3], 0.03, (10.0, 60.0)),
    "hanging": (hanging, [-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], 0.5, None),
}


def plan_of(name, plan, *kind, longer=1.0, **more):
    """A motion of a case; its duration is longer by a factor."""
    make, start, goal, duration, bounds = CASES[name]
    ends = RigidTransform(start), RigidTransform(goal)
    return plan(make(), *ends, longer * duration, *kind, bounds=bounds, **more)


def left(motion, watch=0.3, cables=None):
    return simulate_swing(motion, watch, cables).left()


@pytest.mark.parametrize(("name", "share"), [("rubber", 0.05), ("steel", 0.1), ("hanging", 0.05)])
def test_shaping_takes_the_swing_away(name, share):
    plain, shaped = (plan_of(name, plan_shaped_rest, kind) for kind in (None, "ZVD"))
    way = np.linalg.norm(shaped.goal.X_WP.translation() - shaped.start.X_WP.translation())
    swing = left(plain, 1.2)
    assert swing > 1e-3 * way
    assert left(shaped, 1.2) < share * swing


@pytest.mark.parametrize(("name", "longer"), [("rubber", 1.0), ("steel", 1.5)])
def test_shooting_ends_at_rest_in_the_time_of_the_plain_motion(name, longer):
    """What the simulation, another way of calling the engine, says of what shooting computed."""
    shot, shaped = plan_of(name, plan_shot_rest, longer=longer), plan_of(name, plan_shaped_rest)
    assert shot.end_time == longer * CASES[name][3] < shaped.end_time
    assert left(shot) < min(1e-2 * left(replace(shot, correction=None)), left(shaped))
    np.testing.assert_allclose(shot.lengths_at(np.array([0.0, 9.0])), shot.lengths([0.0, 1.0]))


def test_robust_shooting_minds_a_wrong_stiffness_less():
    soft = CableSettings(stiffness_ratio=0.975)
    plain, robust = (
        left(plan_of("rubber", plan_shot_rest, longer=1.5, ratios=ratios), cables=soft)
        for ratios in ((1.0,), (0.95, 1.0))
    )
    assert robust < 0.2 * plain


@pytest.mark.parametrize(("name", "plan", "longer", "refusal"), [
    ("steel", plan_shot_rest, 2 / 3, r"in which C\d gets slack at 0\.0"),
    ("rubber", plan_shot_rest, 4 / 9,
     r"duration: found 0.2 s, in which C\d would be wound"),
    ("steel", plan_shaped_rest, 0.0, "duration: found 0 s"),
])  # fmt: skip
def test_what_is_too_fast_is_refused(name, plan, longer, refusal):
    with pytest.raises(PlanningError, match=refusal):
        plan_of(name, plan, longer=longer)


def test_what_cannot_be_held_is_refused():
    ends = RigidTransform([-0.1, 0.05, 0.3]), RigidTransform([0.6, 0.0, 0.3])
    with pytest.raises(InfeasibleTensionError, match="no tensions within 10 to 60"):
        plan_shaped_rest(load_robot("planar"), *ends, 0.9, bounds=(10.0, 60.0))
    with pytest.raises(InfeasibleTensionError, match=r"within 10\.\.11 N balance each other"):
        plan_rest_to_rest(example_robot(), (-0.4, 0.4, 0.0), GOAL, 0.6, 3, bounds=(10.0, 11.0))


# Direct collocation through the differentiable plant: a plan that a simulation follows.

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
