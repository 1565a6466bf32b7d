"""Own costs and constraints of a design, against closed forms and brute force."""

import itertools
from functools import cache

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

from cdpr_drake.analyses.design.program import DesignProgram
from cdpr_drake.analyses.design.search import evaluate_design
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings, MirrorSettings
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot

ROBOT = "acrobot_large"
WINCH = load_robot(ROBOT).winch
NEAR = 1e-5  # relative; of SNOPT, with slopes by differences of 1e-4 of a box
GRID = 31
"""Designs of brute force over one variable; the best lies within a step of the grid."""


def small(goal, reach=(0.0, 0.0, 0.0)):
    settings = DesignSettings(goals=[GoalSettings(name=goal)])
    settings.exit_points.reach = np.array(reach)
    settings.poses.counts = np.array([2.0, 2.0, 1.0])
    settings.generations, settings.population = 2, 4
    return settings


def winches():
    """The fastest robot by drum and motor alone."""
    settings = small("speed")
    settings.winch.drum_radius = np.array([0.02, 0.08])
    settings.winch.motor_torque = np.array([0.2, 0.8])
    return DesignProgram(ROBOT, settings)


def heights():
    """All exit points at one height, which alone may change: a design of one variable."""
    settings = small("capacity-margin", reach=(0.0, 0.0, 0.3))
    pairs = [f"C{a}-C{b}" for a, b in itertools.pairwise(range(1, 9))]
    settings.mirrors = [MirrorSettings(axis="x", pairs=pairs)]
    return DesignProgram(ROBOT, settings)


@cache
def margins():
    """Heights and least capacity margins of all designs of one variable, by the goal itself."""
    program, goals = heights(), ("capacity-margin",)
    shares = np.linspace(0.0, 1.0, GRID)
    z = [program.values().at(np.array([share]))[0] for share in shares]
    values = [
        evaluate_design(program.candidates, program.judging, goals, (0, np.array([share])))[0]
        for share in shares
    ]
    return np.array(z), np.array(values)


def solved(program):
    """The result of a program and the robot of its design."""
    result = program.Solve()
    return result, result.candidates.robot(0, result.coordinates[-1])


def test_values_are_those_of_the_robot_file():
    program = DesignProgram(ROBOT, small("speed", reach=(0.1, 0.0, 0.1)))
    v = program.values()
    assert v.names[:3] == ("C1.exit_point.x", "C1.exit_point.z", "C2.exit_point.x")
    points = load_robot(ROBOT).exit_points()
    np.testing.assert_allclose(v.at(np.full(16, 0.5)), points[[0, 2]].T.ravel())
    z = np.random.default_rng(0).uniform(size=16)
    moved = program.candidates.robot(0, program._shares(z)).exit_points()
    np.testing.assert_allclose(v.at(z), moved[[0, 2]].T.ravel(), atol=1e-12)


def test_slopes_of_points_and_winch_are_those_of_differences():
    settings = small("capacity-margin", reach=(0.1, 0.0, 0.1))
    settings.winch.motor_torque, settings.winch.drum_radius = np.array([[0.2, 0.8], [0.02, 0.08]])
    (binding,) = DesignProgram(ROBOT, settings).prog().generic_constraints()
    rows, size = binding.evaluator(), binding.evaluator().num_vars()
    x, step = np.random.default_rng(0).uniform(0.4, 0.6, size), 1e-5
    slopes = ExtractGradient(rows.Eval(InitializeAutoDiff(x)))
    for k in (0, size - 3, size - 2, size - 1):  # a point, both of the winch, the least margin
        e = step * np.eye(size)[k]
        differences = (rows.Eval(x + e) - rows.Eval(x - e)) / (2.0 * step)
        np.testing.assert_allclose(slopes[:, k], differences, atol=1e-5 * np.max(np.abs(slopes)))


def test_with_nothing_added_the_search_answers():
    result = DesignProgram(ROBOT, small("tension-factor", reach=(0.0, 0.0, 0.1))).Solve()
    assert result.program is None
    assert len(result.values) == 8


def test_a_quadratic_preference_is_the_closed_form():
    """Speed grows with the drum's radius: -r / r0 + q (r - a)^2 is least at a + 1 / (2 q r0)."""
    program, r0, a, q = winches(), WINCH.drum_radius, 0.03, 2e3
    program.AddQuadraticCost(a, q, of="drum_radius", name="as in store")
    result, robot = solved(program)
    exact = a + 0.5 / (q * r0)
    assert 0.02 < exact < 0.08
    assert robot.winch.drum_radius == pytest.approx(exact, rel=NEAR)
    costs = result.program.own_costs
    assert costs["as in store"] == pytest.approx(q * (exact - a) ** 2, rel=1e-3)
    assert result.program.cost == pytest.approx(-exact / r0, rel=NEAR)
    assert result.scores == pytest.approx([1.0, exact / r0], rel=NEAR)
    assert result.program.solver == "SNOPT"


def test_a_linear_bound_ties_variables():
    """r <= 0.1 tau, with speed wanted and torque paid for: best at tau = 0.2 + 0.1 / (2 q r0)."""
    program, q = winches(), 20.0
    program.AddLinearConstraint([1.0, -0.1], -np.inf, 0.0, of=["drum_radius", "motor_torque"],
                                name="slim")  # fmt: skip
    program.AddQuadraticCost(0.2, q, of="motor_torque", name="price")
    _, robot = solved(program)
    exact = 0.2 + 0.1 / (2.0 * q * WINCH.drum_radius)
    assert 0.2 < exact < 0.8
    assert robot.winch.motor_torque == pytest.approx(exact, rel=NEAR)
    assert robot.winch.drum_radius == pytest.approx(0.1 * exact, rel=NEAR)


def test_a_linear_bound_of_a_point_is_brute_force():
    z, values = margins()
    now = float(load_robot(ROBOT).exit_points()[2, 0])
    most = 0.5 * (now + z[np.argmax(values)])  # half the way to what the goal alone wants
    low, high = sorted((most, now))
    program = heights()
    program.AddLinearConstraint([1.0], low, high, name="ceiling")
    result, robot = solved(program)
    inside = (z >= low - 1e-9) & (z <= high + 1e-9)
    best = z[inside][np.argmax(values[inside])]
    assert robot.cable_set().p_WA[2, 0] == pytest.approx(best, abs=z[1] - z[0])
    assert result.values[-1, 0] >= np.max(values[inside]) - 1e-6


def test_a_nonlinear_cost_is_brute_force():
    z, values = margins()
    now = z[GRID // 2]

    def price(v):
        return 3.0 * float(np.cosh((v[0] - now) / 0.1) - 1.0)

    whole = -values / abs(values[GRID // 2]) + np.array([price([height]) for height in z])
    program = heights()
    program.AddCost(price, name="price")
    result, robot = solved(program)
    best = z[np.argmin(whole)]
    assert robot.cable_set().p_WA[2, 0] == pytest.approx(best, abs=z[1] - z[0])
    assert result.program.cost + result.program.own_costs["price"] <= np.min(whole) + 1e-6
    assert "by evolution may find" in result.program.lost[0]


def test_goals_that_are_not_wanted_can_be_bounds_and_costs():
    program = winches()
    program.AddGoalConstraint("power", upper=8 * 0.5 * WINCH.rated_motor_speed())
    program.AddGoalCost(lambda v: -1e-3 * float(v[0]), "power", name="strong")
    result, robot = solved(program)
    assert robot.winch.motor_torque == pytest.approx(0.5, rel=1e-4)
    assert robot.winch.drum_radius == pytest.approx(0.08, rel=1e-4)
    assert result.program.own_constraints == ("power",)


def unkept():
    program = winches()
    program.AddLinearConstraint([1.0], 0.5, 1.0, of="drum_radius", name="huge drum")
    program.Solve()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (unkept, "a design: found none with huge drum"),
        (lambda: DesignProgram(ROBOT, small("static", (0.1, 0, 0))), "found 'static'; acc"),
        (lambda: DesignProgram(ROBOT, small("static")), "found nothing that may"),
        (lambda: DesignProgram(ROBOT, small("speed", (0.1, 0, 0)), number=1), "number: found 1"),
        (lambda: winches().values("C1.*"), "of: found 'C1.*'; acc"),
        (lambda: winches().AddGoalConstraint("csw"), "found 'csw'"),
    ],
)
def test_bad_input_is_one_line(change, words):
    with pytest.raises(DesignError, match=words) as refused:
        change()
    assert "\n" not in str(refused.value)
