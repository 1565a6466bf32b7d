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

# Rest to rest without swing on the simulated robot: elastic cables, steel, and four cables.


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


@pytest.mark.parametrize(("name", "share"), [("rubber", 0.05), ("steel", 0.1), ("hanging", 0.05)])
def test_shaping_takes_the_swing_away(name, share):
    make, start, goal, duration, bounds = CASES[name]
    left = []
    for kind in (None, "ZVD"):
        motion = plan_shaped_rest(
            make(), RigidTransform(start), RigidTransform(goal), duration, kind, bounds=bounds
        )
        left.append(simulate_swing(motion, 1.2).left())
    way = np.linalg.norm(motion.goal.X_WP.translation() - motion.start.X_WP.translation())
    assert left[0] > 1e-3 * way
    assert left[1] < share * left[0]


@pytest.mark.parametrize(("name", "longer"), [("rubber", 1.0), ("steel", 1.5)])
def test_shooting_ends_at_rest_in_the_time_of_the_plain_motion(name, longer):
    """What the simulation, another way of calling the engine, says of what shooting found."""
    make, start, goal, duration, bounds = CASES[name]
    ends = RigidTransform(start), RigidTransform(goal)
    shot = plan_shot_rest(make(), *ends, longer * duration, bounds=bounds)
    assert shot.end_time == longer * duration
    plain = replace(shot, correction=None)
    left = [simulate_swing(motion, 0.3).left() for motion in (plain, shot)]
    assert left[1] < 1e-2 * left[0]
    shaped = plan_shaped_rest(make(), *ends, duration, "ZVD", bounds=bounds)
    assert left[1] < simulate_swing(shaped, 0.3).left()
    assert shaped.end_time > shot.end_time
    np.testing.assert_allclose(shot.lengths_at(np.array([0.0, 9.0])), shot.lengths([0.0, 1.0]))


def test_robust_shooting_minds_a_wrong_stiffness_less():
    make, start, goal, duration, bounds = CASES["rubber"]
    ends = RigidTransform(start), RigidTransform(goal)
    soft = CableSettings(stiffness_ratio=0.975)
    left = [
        simulate_swing(
            plan_shot_rest(make(), *ends, 1.5 * duration, bounds=bounds, ratios=ratios), 0.3, soft
        ).left()
        for ratios in ((1.0,), (0.95, 1.0))
    ]
    assert left[1] < 0.2 * left[0]


def test_a_cable_that_gets_slack_is_named():
    make, start, goal, _, bounds = CASES["steel"]
    with pytest.raises(PlanningError, match=r"in which C\d gets slack at 0\.0"):
        plan_shot_rest(make(), RigidTransform(start), RigidTransform(goal), 0.02, bounds=bounds)


def test_what_cannot_be_wound_or_held_is_refused():
    robot = load_robot("planar")
    ends = RigidTransform([-0.1, 0.05, 0.3]), RigidTransform([0.15, -0.05, 0.3])
    with pytest.raises(PlanningError, match=r"duration: found 0.2 s, in which C\d would be wound"):
        plan_shaped_rest(robot, *ends, 0.2, None, bounds=(10.0, 60.0))
    with pytest.raises(PlanningError, match="duration: found 0 s"):
        plan_shaped_rest(robot, *ends, 0.0)
    out = RigidTransform([0.6, 0.0, 0.3])
    with pytest.raises(InfeasibleTensionError, match="no tensions within 10 to 60"):
        plan_shaped_rest(robot, ends[0], out, 0.9, bounds=(10.0, 60.0))


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


def test_ends_that_nothing_holds_are_refused():
    with pytest.raises(InfeasibleTensionError, match=r"within 10\.\.11 N balance each other"):
        plan_rest_to_rest(example_robot(), (-0.4, 0.4, 0.0), GOAL, 0.6, 3, bounds=(10.0, 11.0))
