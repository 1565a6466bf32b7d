"""Own costs and constraints of a design, against closed forms and brute force."""

import itertools
from functools import cache

import numpy as np
import pytest

from cdpr_drake.analyses.design.goals import evaluate_goals
from cdpr_drake.analyses.design.program import DesignProgram
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings, MirrorSettings
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot

ROBOT = "acrobot_large"
NEAR = 1e-5  # relative; of SNOPT, with slopes by differences of 1e-4 of a box
GRID = 31
"""Designs of brute force over one variable; the best lies within a step of the grid."""


def wanted(*goals, reach=(0.0, 0.0, 0.0), **weights):
    settings = DesignSettings(
        goals=[GoalSettings(name=name, weight=weights.get(name, 1.0)) for name in goals]
    )
    settings.exit_points.reach = np.array(reach)
    settings.poses.counts = np.array([2.0, 2.0, 1.0])
    settings.generations, settings.population = 2, 4
    return settings


def winches(*goals):
    settings = wanted(*goals)
    settings.winch.drum_radius = np.array([0.02, 0.08])
    settings.winch.motor_torque = np.array([0.2, 0.8])
    return settings


def heights():
    """All exit points at one height, which alone may change: a design of one variable."""
    settings = wanted("capacity-margin", reach=(0.0, 0.0, 0.3))
    names = [f"C{i}" for i in range(1, 9)]
    settings.mirrors = [
        MirrorSettings(axis="x", pairs=[f"{a}-{b}" for a, b in itertools.pairwise(names)])
    ]
    return settings


@cache
def margins():
    """Heights and least capacity margins of all designs of one variable, by the goal itself."""
    program = DesignProgram(ROBOT, heights())
    shares = np.linspace(0.0, 1.0, GRID)
    z = [program.values().at(np.array([share]))[0] for share in shares]
    found = [
        evaluate_goals(
            program.candidates.robot(0, np.array([s])), program.judging, ("capacity-margin",)
        )[0]
        for s in shares
    ]
    return np.array(z), np.array(found)


def height_of(found):
    robot = found.candidates.robot(0, found.coordinates[-1])
    return float(robot.cable_set().p_WA[2, 0])


def test_values_are_those_of_the_robot_file():
    program = DesignProgram(ROBOT, wanted("speed", reach=(0.1, 0.0, 0.1)))
    robot = load_robot(ROBOT)
    v = program.values()
    assert v.names[:3] == ("C1.exit_point.x", "C1.exit_point.z", "C2.exit_point.x")
    np.testing.assert_allclose(v.at(np.full(16, 0.5)), robot.exit_points()[[0, 2]].T.ravel())
    z = np.random.default_rng(0).uniform(size=16)
    moved = program.candidates.robot(0, program._shares(z)).exit_points()
    np.testing.assert_allclose(v.at(z), moved[[0, 2]].T.ravel(), atol=1e-12)


def test_with_nothing_added_the_search_answers():
    settings = wanted("tension-factor", reach=(0.0, 0.0, 0.1))
    found = DesignProgram(ROBOT, settings).Solve()
    assert found.program is None
    assert len(found.values) == 8


def test_a_quadratic_preference_is_the_closed_form():
    """Speed grows with the drum's radius: -r / r0 + q (r - a)^2 is least at a + 1 / (2 q r0)."""
    program = DesignProgram(ROBOT, winches("speed"))
    r0, a, q = load_robot(ROBOT).winch.drum_radius, 0.03, 2e3
    program.AddQuadraticCost(a, q, of="drum_radius", name="as in store")
    found = program.Solve()
    exact = a + 0.5 / (q * r0)
    assert 0.02 < exact < 0.08
    robot = found.candidates.robot(0, found.coordinates[-1])
    assert robot.winch.drum_radius == pytest.approx(exact, rel=NEAR)
    assert found.program.own_costs["as in store"] == pytest.approx(q * (exact - a) ** 2, rel=1e-3)
    assert found.program.cost == pytest.approx(-exact / r0, rel=NEAR)
    assert found.scores[-1] == pytest.approx(exact / r0, rel=NEAR)
    assert found.scores[0] == pytest.approx(1.0)
    assert found.program.solver == "SNOPT"


def test_a_linear_bound_ties_variables():
    """r <= 0.1 tau, with speed wanted and torque paid for: best at tau = 0.2 + 0.1 / (2 q r0)."""
    program = DesignProgram(ROBOT, winches("speed"))
    r0, q = load_robot(ROBOT).winch.drum_radius, 20.0
    program.AddLinearConstraint([1.0, -0.1], -np.inf, 0.0, of=["drum_radius", "motor_torque"],
                                name="slim")  # fmt: skip
    program.AddQuadraticCost(0.2, q, of="motor_torque", name="price")
    found = program.Solve()
    winch = found.candidates.robot(0, found.coordinates[-1]).winch
    exact = 0.2 + 0.1 / (2.0 * q * r0)
    assert 0.2 < exact < 0.8
    assert winch.motor_torque == pytest.approx(exact, rel=NEAR)
    assert winch.drum_radius == pytest.approx(0.1 * exact, rel=NEAR)


def test_a_linear_bound_of_a_point_is_brute_force():
    z, found = margins()
    best = z[np.argmax(found)]
    now = float(load_robot(ROBOT).exit_points()[2, 0])
    most = 0.5 * (now + best)  # half the way to what the goal alone wants
    program = DesignProgram(ROBOT, heights())
    low, high = sorted((most, now))
    program.AddLinearConstraint([1.0], low, high, name="ceiling")
    solved = program.Solve()
    inside = (z >= low - 1e-9) & (z <= high + 1e-9)
    assert height_of(solved) == pytest.approx(z[inside][np.argmax(found[inside])], abs=z[1] - z[0])
    assert solved.values[-1, 0] >= np.max(found[inside]) - 1e-6


def test_a_nonlinear_cost_is_brute_force():
    z, found = margins()
    size = abs(found[GRID // 2])
    now = z[GRID // 2]

    def price(v):
        return 3.0 * float(np.cosh((v[0] - now) / 0.1) - 1.0)

    whole = -found / size + np.array([price([one]) for one in z])
    program = DesignProgram(ROBOT, heights())
    program.AddCost(price, name="price")
    solved = program.Solve()
    assert height_of(solved) == pytest.approx(z[np.argmin(whole)], abs=z[1] - z[0])
    both = solved.program.cost + solved.program.own_costs["price"]
    assert both <= np.min(whole) + 1e-6
    assert "by evolution may find" in solved.program.lost[0]


def test_goals_that_are_not_wanted_can_be_bounds_and_costs():
    program = DesignProgram(ROBOT, winches("speed"))
    now = load_robot(ROBOT).winch
    power = 8 * 0.5 * now.rated_motor_speed()
    program.AddGoalConstraint("power", upper=power)
    program.AddGoalCost(lambda v: -1e-3 * float(v[0]), "power", name="strong")
    winch = (found := program.Solve()).candidates.robot(0, found.coordinates[-1]).winch
    assert winch.motor_torque == pytest.approx(0.5, rel=1e-4)
    assert winch.drum_radius == pytest.approx(0.08, rel=1e-4)
    assert found.program.own_constraints == ("power",)


def test_own_terms_that_no_design_keeps_are_said():
    program = DesignProgram(ROBOT, winches("speed"))
    program.AddLinearConstraint([1.0], 0.5, 1.0, of="drum_radius", name="huge drum")
    with pytest.raises(DesignError, match="a design: found none with huge drum"):
        program.Solve()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda: DesignProgram(ROBOT, wanted("static", reach=(0.1, 0, 0))), "found 'static'; acc"),
        (lambda: DesignProgram(ROBOT, winches("speed"), number=1), "number: found 1; accepted: 0"),
        (lambda: DesignProgram(ROBOT, winches("speed")).values("C1.*"), "of: found 'C1.*'; acc"),
        (lambda: DesignProgram(ROBOT, winches("speed")).AddGoalConstraint("csw"), "found 'csw'"),
    ],
)
def test_bad_input_is_one_line(change, words):
    with pytest.raises(DesignError, match=words) as refused:
        change()
    assert "\n" not in str(refused.value)
