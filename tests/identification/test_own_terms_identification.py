"""Own costs and constraints of an identification, against priors, closed forms and scipy."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import NonlinearConstraint, minimize

from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import pseudo_inertia
from tests.identification.logs import TRUE, believed, samples

PLATFORM = ("mass", "center_of_mass", "inertia")
NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}
SHARE = 1e-3  # of standard errors, by which convex solvers may differ
LOCAL = 0.05  # of standard errors, by which solvers of nonlinear programs may


@cache
def motion():
    return samples(span=4.0, **NOISE)


def made(unknown=PLATFORM):
    program = IdentificationProgram(believed(), unknown)
    program.AddMotion(motion())
    return program


@cache
def plain():
    return made().Solve(outliers=False)


def by_scipy(found, extra, constraints=()):
    """Half of chi-square with the weights at what was found, and an own cost, by another solver."""
    program = made()
    theta, typical = found.model.vector(), program.layout.typical
    rows = program.equations.at(theta).rows
    A = np.vstack([r.A[:, :10] for r in rows])
    b = np.concatenate([r.b - r.A[:, 10:] @ (theta / typical)[10:] for r in rows])

    def values(x):
        return program.layout.values(np.concatenate([x * typical[:10], theta[10:]]))

    def cost(x):
        return 0.5 * float(np.sum((A @ x - b) ** 2)) + extra(values(x))

    start = plain().model.vector()[:10] / typical[:10]
    rules = [
        NonlinearConstraint(lambda x, rule=rule: rule(values(x)), 0.0, np.inf)
        for rule in constraints
    ]
    solved = minimize(cost, start, method="SLSQP", constraints=rules,
                      options={"ftol": 1e-15, "maxiter": 500})  # fmt: skip
    assert solved.success or solved.status == 8, solved.message  # 8: as near as rounding lets it
    return values(solved.x), solved.fun


def test_nothing_added_and_a_cost_of_nothing_change_nothing():
    program = made()
    program.prog()
    again = program.Solve(outliers=False)
    assert again.program is None
    assert again.values.tobytes() == plain().values.tobytes()
    program.AddQuadraticCost(0.0, 0.0, of="mass")
    found = program.Solve(outliers=False)
    assert np.max(np.abs(found.values - plain().values) / plain().std) < SHARE
    assert found.program.solver == "Clarabel"
    assert found.program.cost == pytest.approx(0.5 * plain().chi_square, rel=1e-6)


def test_a_quadratic_preference_is_a_prior():
    std = 0.02
    other = made()
    other.AddPrior("mass", std)
    prior = other.Solve(outliers=False)
    program = made()
    program.AddQuadraticCost(believed().mass, 0.5 / std**2, of="mass", name="on the scales")
    found = program.Solve(outliers=False)
    assert np.max(np.abs(found.values - prior.values) / prior.std) < SHARE
    assert abs(found.values[0] - plain().values[0]) > 3.0 * plain().std[0]
    own = 0.5 * ((found.values[0] - believed().mass) / std) ** 2
    assert found.program.own_costs["on the scales"] == pytest.approx(own, rel=1e-6)
    assert "own terms are not in them" in found.program.lost[0]


def round_about(v):
    """Products of inertia are small beside the moments, in logarithms."""
    return 200.0 * float(np.log(abs(v[4] / v[5])) ** 2 + np.log(abs(v[4] / v[6])) ** 2)


def in_the_box(program):
    """A bound of a ratio, moments over mass, is linear times mass."""
    low = plain().values[1] + 2.0 * plain().std[1]
    program.AddLinearConstraint([1.0], low, 0.1, of="center_of_mass.x")
    return "Clarabel", [lambda v: v[1] - low], lambda v: 0.0


def same_about_two_axes(program):
    """Linear in values that are no ratios goes to a nonlinear program."""
    program.AddLinearConstraint([1.0, -1.0], 0.0, 0.0, of=["inertia.xx", "inertia.yy"])
    rules = [lambda v: (v[4] - v[5]) / 0.02, lambda v: (v[5] - v[4]) / 0.02]
    return "SNOPT", rules, lambda v: 0.0


def nonlinear(program):
    program.AddCost(round_about, name="round")
    return "SNOPT", [], round_about


@pytest.mark.parametrize("add", [in_the_box, same_about_two_axes, nonlinear])
def test_own_terms_end_where_scipy_does(add):
    program = made()
    solver, rules, cost = add(program)
    found = program.Solve(outliers=False)
    assert found.program.solver == solver
    other, least = by_scipy(found, cost, rules)
    assert np.max(np.abs(found.values - other) / plain().std) < LOCAL
    own = sum(found.program.own_costs.values())
    assert found.program.cost + own == pytest.approx(least, rel=1e-5)
    assert np.max(np.abs(found.values - plain().values) / plain().std) > 0.5
    assert all(rule(found.values) > -1e-5 for rule in rules)
    assert np.linalg.eigvalsh(pseudo_inertia(found.model.inertial()))[0] > 0.0


def test_outliers_count_less_with_own_terms_too():
    """Weights are Huber's at what was found: another step finds it again."""
    program, robust = made(), made().Solve()
    program.AddQuadraticCost(TRUE.mass, 0.5 / 0.01**2, of="mass")
    found = program.Solve()
    assert abs(found.values[0] - TRUE.mass) < abs(robust.values[0] - TRUE.mass) + 1e-9
    assert found.last_step < 1e-5


def test_friction_is_linear_in_the_vector():
    program = IdentificationProgram(believed(), ("friction", "static_friction"))
    program.AddMotion(motion())
    every = program.values()
    assert every.transform is None
    x = believed().vector() / program.layout.typical
    np.testing.assert_allclose(every.at(x), program.layout.values(believed().vector()))
    assert program.values("C2.*").names == ("C2.coulomb", "C2.viscous", "C2.static")


@pytest.mark.parametrize("common", [(), ("stiffness", "damping", "friction")])
def test_values_are_those_of_the_model(common):
    """All groups at once, and where one is for all cables."""
    model = believed(offset=np.full(8, 0.03), retardation=np.full(8, 2e-3))
    unknown = (*PLATFORM, "stiffness", "damping", "friction", "static_friction")
    layout = IdentificationProgram(model, unknown, common=common).layout
    one = 1 if common else 8
    each = model.stiffness[:one], model.retardation[:one], model.offset, model.coulomb[:one]
    expected = [[model.mass], model.center_of_mass, model.inertia, *each, model.viscous[:one]]
    expected = np.concatenate([*expected, model.static])
    np.testing.assert_allclose(layout.values(model.vector()), expected, rtol=1e-9)


def test_own_terms_that_no_robot_keeps_are_said():
    program = made()
    program.AddLinearConstraint([1.0], 9.0, 10.0, of="mass", name="heavy")
    program.AddLinearConstraint([1.0], 0.0, 1.0, of="mass", name="light")
    with pytest.raises(IdentificationError, match="parameters that some robot has: found none"):
        program.Solve()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.AddQuadraticCost(1.0, of="stiffness"), "found 'stiffness'; accepted: mass"),
        (lambda p: p.AddLinearConstraint([1.0], -np.inf, np.inf, of="center_of_mass.x"),
         "found no finite bound"),
        (lambda p: p.AddLinearConstraint([1.0, 1.0], 0.0, 1.0, of="mass"), r"shape \(1, 2\)"),
        (lambda p: (p.prog(), p.AddPrior("mass", 1.0)), "AddPrior: found a program that"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(change, words):
    with pytest.raises(IdentificationError, match=words) as refused:
        change(made())
    assert "\n" not in str(refused.value)
