"""What has to hold between kinds of workspaces, of two robots: one hangs, one is planar."""

from itertools import combinations

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.conditions import OF_POSES, conditions_at
from cdpr_drake.analyses.workspaces.robot_conditions import grid_conditions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.pose_grid import grid_by_count

POINTS = (5, 5, 4)
BOX = np.array([0.05, 0.05, 0.05, 1.0, 1.0, 1.0])
EVERY = {
    "required": SpatialSet(box=BOX), "accelerations": SpatialSet(box=np.ones(6)), "pulleys": False,
}  # fmt: skip
NOTHING = {"required": SpatialSet(), "accelerations": SpatialSet(), "pulleys": False}
KINDS = tuple(kind for kind in OF_POSES if kind != "target-visible")

robots = pytest.mark.parametrize("robot", ["caroca_gazebo", "planar"])


def holds(robot, kinds, **request):
    """Where kinds hold over a robot's frame, by kind, shape (n,)."""
    grid = grid_by_count(*load_robot(robot).reach(), POINTS)
    about = grid_conditions(robot, kinds, (), grid, **request)
    arrays = conditions_at(about, grid, kinds, (0, grid.size))
    return {kind: inside.astype(bool) for kind, inside in arrays.items()}


def is_within(inner, outer):
    return np.any(inner) and not np.any(inner & ~outer)


@robots
def test_kinds_lie_within_others(robot):
    """Their sets contain zero, or they ask for more."""
    every = holds(robot, KINDS, **EVERY)
    for inner, outer in (
        ("wrench-feasible", "static"), ("dynamic", "static"), ("statically-stable", "static"),
        ("statically-stable", "singularity-free"),
    ):  # fmt: skip
        assert not np.any(every[inner] & ~every[outer]), (inner, outer)
    assert is_within(every["dynamic"], every["static"])


@robots
def test_kinds_together_are_what_each_is_alone(robot):
    together = holds(robot, KINDS, **EVERY)
    alone = {kind: holds(robot, [kind], **EVERY)[kind] for kind in KINDS}
    for kind in KINDS:
        np.testing.assert_array_equal(together[kind], alone[kind])
    common = [np.sum(together[a] & together[b]) for a, b in combinations(KINDS, 2)]
    assert np.max(common) > 0


@robots
@pytest.mark.parametrize("kind", ["dynamic", "wrench-feasible"])
def test_with_no_demand_but_zero_kinds_are_static(robot, kind):
    """Facets of the available wrenches against a search for tensions: different computations."""
    zero = holds(robot, ["static", kind], **NOTHING)
    np.testing.assert_array_equal(zero[kind], zero["static"])
    assert np.any(zero[kind])


def test_closure_depends_on_no_weight_and_holds_it_without_upper_limit():
    closure = holds("planar", ["wrench-closure"], pulleys=False)["wrench-closure"]
    robot = load_robot("planar")
    heavy = holds("planar", ["wrench-closure"], mass=3.0 * robot.platform.mass, pulleys=False)
    np.testing.assert_array_equal(heavy["wrench-closure"], closure)
    limits = (robot.tension_limits(None)[0], 1e9)
    assert is_within(closure, holds("planar", ["static"], limits=limits, pulleys=False)["static"])


@pytest.mark.parametrize(
    ("robot", "lower", "upper"), [("acrobot_large", 1.0, 60.0), ("caroca", 30.0, 1e4)]
)
def test_a_higher_lower_limit_leaves_less(robot, lower, upper):
    low, high = (
        holds(robot, ["static"], limits=(limit, upper), pulleys=False)["static"]
        for limit in (0.0, lower)
    )
    assert is_within(high, low)
