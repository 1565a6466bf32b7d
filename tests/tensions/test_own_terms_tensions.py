"""Own costs and constraints of tensions, against closed forms, scipy and other solvers."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.optimize import minimize

from cdpr_drake.cli import main
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.methods import METHODS, Distributor, TensionMethod, distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.tensions.program import TensionProgram
from tests.messages import printed
from tests.tensions.tension_cases import acrobot

SOLVER = 1e-4  # [N]; OSQP and SNOPT stop at 1e-8 and 1e-6 of a weight of 34 N, and bend little
LOCAL = 2e-3  # [N]; SLSQP stops where the cost of 1e2 N^2 changes by 1e-12 of it

PLACES = [(0.2, 0.1, 0.3), (-0.1, 0.15, 0.4), (0.0, 0.0, 0.2)]


@pytest.fixture
def own_method():
    """Makes methods, and takes them out of the table again."""
    before = set(METHODS)
    yield TensionMethod.from_program
    for name in set(METHODS) - before:
        del METHODS[name]


def by_scipy(problem, cost, constraints=()):
    """The least cost within bounds and balance, by another solver in other variables."""
    start = distribute(problem, "optimally_safe").tensions
    found = minimize(
        cost, start, method="SLSQP", bounds=list(zip(problem.lower, problem.upper, strict=True)),
        constraints=[
            {"type": "eq", "fun": lambda t: problem.W @ t + problem.wrench,
             "jac": lambda t: problem.W},
            *constraints,
        ],
        options={"ftol": 1e-13, "maxiter": 500},
    )  # fmt: skip
    assert found.success, found.message
    return found.x


@pytest.mark.parametrize("goal", [name for name, m in METHODS.items() if m.program])
def test_with_nothing_added_the_kernel_answers(goal):
    problem = acrobot(RigidTransform(PLACES[0]), 1.0, reference=np.full(8, 6.0))
    found, kernel = TensionProgram(problem, goal).Solve(), distribute(problem, goal)
    assert found.program is None
    assert found.as_dict() == kernel.as_dict()
    np.testing.assert_array_equal(found.tensions, kernel.tensions)


@pytest.mark.parametrize("place", PLACES)
def test_a_quadratic_preference_is_the_closed_form(place):
    """min |t|^2 + q |t - g|^2 with W t + w = 0 and bounds that do not bind: by the normal equations
    of Lagrange."""
    problem = acrobot(RigidTransform(place), 0.0)
    goal, q = distribute(problem, "optimally_safe").tensions + np.linspace(-0.1, 0.1, 8), 20.0
    program = TensionProgram(problem)
    program.AddQuadraticCost(goal, q, name="near")
    found = program.Solve()
    W, w = problem.W, problem.wrench
    free = q * goal / (1.0 + q)
    exact = free - W.T @ np.linalg.solve(W @ W.T, W @ free + w)
    assert np.all(exact > 0.0)
    np.testing.assert_allclose(found.tensions, exact, rtol=0.0, atol=SOLVER)
    assert found.status == TensionStatus.FEASIBLE
    assert found.program.solver == "OSQP"
    assert found.program.cost == pytest.approx(exact @ exact, rel=1e-6)
    own = q * np.sum((exact - goal) ** 2)
    assert found.program.own_costs["near"] == pytest.approx(own, rel=1e-6)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("goal", ["quadratic_program", "infinity_norm", "linear_program"])
def test_a_linear_bound_holds_and_costs_as_little_as_can_be(place, goal):
    """Sums of cables: against Clarabel on a program that is written out here.

    The bounds are half the way from what the goal alone gives to the safest tensions, so that there
    are tensions within them.
    """
    problem = acrobot(RigidTransform(place), 1.0)
    A = np.array([[1.0, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 1.0, 1.0, 1.0, 0]])
    plain, safe = (distribute(problem, name).tensions for name in (goal, "optimally_safe"))
    A *= np.sign(A @ (safe - plain))[:, None]
    least = 0.5 * A @ (plain + safe)
    program = TensionProgram(problem, goal)
    program.AddLinearConstraint(A, least, np.inf, name="sums")
    found = program.Solve()
    t = found.tensions
    assert np.any(A @ plain < least - 0.01)  # one binds
    assert np.all(A @ t >= least - SOLVER)
    assert problem.residual(t) <= 1e-9
    check = MathematicalProgram()
    x = check.NewContinuousVariables(8)
    check.AddLinearEqualityConstraint(problem.W, -problem.wrench, x)
    check.AddBoundingBoxConstraint(problem.lower, problem.upper, x)
    check.AddLinearConstraint(A, least, [np.inf] * 2, x)
    measure = {
        "quadratic_program": lambda t: t @ t, "infinity_norm": np.max, "linear_program": np.sum,
    }[goal]  # fmt: skip
    if goal == "quadratic_program":
        check.AddQuadraticCost(2.0 * np.eye(8), np.zeros(8), x)
    elif goal == "linear_program":
        check.AddLinearCost(np.ones(8), x)
    else:
        (most,) = check.NewContinuousVariables(1)
        check.AddLinearCost(1.0 * most)
        for one in x:
            check.AddLinearConstraint(one <= most)
    other = ClarabelSolver().Solve(check).GetSolution(x)
    assert measure(t) == pytest.approx(measure(other), rel=1e-5)
    assert found.program.own_constraints == ("sums",)


@pytest.mark.parametrize("place", PLACES)
def test_a_nonlinear_cost_finds_what_scipy_finds(place):
    problem = acrobot(RigidTransform(place), 1.0)

    def uneven(t):
        return 50.0 * np.var(np.log(t)) - 100.0 * np.log(t[0])

    program = TensionProgram(problem)
    program.AddCost(uneven, name="uneven")
    found = program.Solve()
    other = by_scipy(problem, lambda t: t @ t + uneven(t))
    whole = [t @ t + uneven(t) for t in (found.tensions, other)]
    assert whole[0] == pytest.approx(whole[1], rel=1e-6)
    np.testing.assert_allclose(found.tensions, other, rtol=0.0, atol=LOCAL)
    assert found.program.solver == "SNOPT"
    assert np.max(np.abs(found.tensions - distribute(problem).tensions)) > 0.1


def test_a_nonlinear_constraint_holds():
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    plain = distribute(problem).tensions
    program = TensionProgram(problem)
    most = 0.9 * plain[4] * plain[5]
    program.AddConstraint(lambda t: t[0] * t[1], 0.0, most, of=["cable 5", "cable 6"], name="pair")
    t = program.Solve().tensions
    assert t[4] * t[5] == pytest.approx(most, rel=1e-4)
    rule = {"type": "ineq", "fun": lambda t: most - t[4] * t[5]}
    other = by_scipy(problem, lambda t: t @ t, [rule])
    np.testing.assert_allclose(t, other, rtol=0.0, atol=LOCAL)


def test_what_goes_to_prog_counts():
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    program = TensionProgram(problem)
    t = program.tensions()
    program.prog().AddLinearEqualityConstraint(t[2] - t[3], 0.0)
    found = program.Solve()
    assert found.tensions[2] == pytest.approx(found.tensions[3], abs=SOLVER)
    assert found.program.own_constraints == ("own constraint 1",)


def test_terms_that_exclude_all_tensions_are_said():
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    program = TensionProgram(problem)
    program.AddLinearConstraint(np.ones(8), 0.0, 10.0, name="sum below 10 N")
    found = program.Solve()
    assert found.status == TensionStatus.NOT_FOUND
    assert np.all(np.isnan(found.tensions))
    assert found.program.lost == (
        "no tensions within the bounds that balance the wrench keep sum below 10 N",
    )


def test_a_problem_without_tensions_stays_proven():
    problem = acrobot(RigidTransform(PLACES[0]), 1.0, 2.0)
    program = TensionProgram(problem)
    program.AddQuadraticCost(1.0)
    assert program.Solve().status == TensionStatus.INFEASIBLE


def test_a_relaxed_goal_takes_own_terms():
    problem = acrobot(RigidTransform(PLACES[0]), 1.0, 5.0)
    program = TensionProgram(problem, "slack_relaxed")
    program.AddLinearConstraint(np.ones(8), -np.inf, 20.0, name="sum")
    found = program.Solve()
    assert found.status == TensionStatus.INFEASIBLE
    assert np.sum(found.tensions) <= 20.0 + SOLVER
    more = np.linalg.norm(distribute(problem, "slack_relaxed").slack)
    assert np.linalg.norm(found.slack) > more


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.AddQuadraticCost(np.ones(3)), r"wanted: found shape \(3,\); accepted: \(8,\)"),
        (lambda p: p.AddQuadraticCost(1.0, -np.ones(8)), "eigenvalue -1; accepted: none below 0"),
        (lambda p: p.AddQuadraticCost(np.nan), "wanted: found NaN"),
        (lambda p: p.AddLinearConstraint(np.ones(3), 0.0, 1.0), r"A: found shape \(1, 3\)"),
        (lambda p: p.AddLinearConstraint(np.ones(8), 1.0, 0.0), "found lower 1 above upper 0"),
        (lambda p: p.AddCost(lambda t: t), r"found an array of shape \(8,\)"),
        (lambda p: p.AddCost(lambda t: np.nan), "found NaN or infinity where the search starts"),
        (lambda p: p.AddCost(lambda t: "much"), "own term: found no numbers"),
        (lambda p: p.AddQuadraticCost(1.0, of="C9"), "of: found 'C9'; accepted: cable 1, cable 2"),
    ],
)
def test_bad_input_is_one_line(change, words):
    program = TensionProgram(acrobot(RigidTransform(PLACES[0]), 1.0))
    with pytest.raises(TensionProblemError, match=words) as refused:
        change(program)
    assert "\n" not in str(refused.value)
    assert not program.has_own_terms


def even(problem):
    """Near 12 N, and the first two cables within 0.1 N."""
    program = TensionProgram(problem)
    program.AddQuadraticCost(12.0, 3.0, name="near 12 N")
    program.AddLinearConstraint([1.0, -1.0], -0.1, 0.1, of=["cable 1", "cable 2"], name="even")
    return program


def test_a_method_made_of_a_program_is_taken_by_its_name(own_method):
    method = own_method("even", even, "near 12 N, even")
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    expected = even(problem).Solve().tensions
    assert abs(expected[0] - expected[1]) <= 0.1 + SOLVER
    for found in (distribute(problem, "even"), Distributor(problem, "even")(
        problem.W, problem.wrench, np.full(8, 5.0))):  # fmt: skip
        assert found.status == TensionStatus.FEASIBLE
        np.testing.assert_allclose(found.tensions, expected, rtol=0.0, atol=SOLVER)
    t, codes = distribute_batch(
        np.array([problem.W] * 3), np.array([problem.wrench] * 3), problem.lower, problem.upper,
        "even",
    )  # fmt: skip
    np.testing.assert_array_equal(codes, 1)
    np.testing.assert_allclose(t, [expected] * 3, rtol=0.0, atol=SOLVER)
    assert method.step_times.steps >= 5
    assert method.step_times.missed == 0


def test_every_wrench_gets_its_own_tensions_from_one_program(own_method):
    """The program is built once; W and wrench change in it."""
    built = []

    def build(problem):
        built.append(problem)
        return even(problem)

    own_method("even", build)
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    ask, last = Distributor(problem, "even"), None
    for place in PLACES * 2:
        there = acrobot(RigidTransform(place), 1.0)
        last = ask(there.W, there.wrench, last).tensions
        np.testing.assert_allclose(last, even(there).Solve().tensions, rtol=0.0, atol=SOLVER)
    assert len(built) == 1


def test_what_a_program_misses_is_told_from_what_nothing_can_do(own_method):
    def build(problem):
        program = TensionProgram(problem)
        program.AddLinearConstraint(np.ones(8), 0.0, 10.0)
        return program

    own_method("little", build)
    problem = acrobot(RigidTransform(PLACES[0]), 1.0)
    assert distribute(problem, "little").status == TensionStatus.NOT_FOUND
    narrow = acrobot(RigidTransform(PLACES[0]), 1.0, 2.0)
    assert distribute(narrow, "little").status == TensionStatus.INFEASIBLE


def test_a_robot_without_redundancy_keeps_own_constraints(own_method):
    """W t + w = 0 alone says the tensions; those that break a constraint are missed."""
    W, t = np.eye(3), np.array([1.0, 2.0, 3.0])
    problem = TensionProblem(W, -t, np.zeros(3), np.full(3, 9.0))

    def build(most):
        def made(problem):
            program = TensionProgram(problem)
            program.AddLinearConstraint(np.ones(3), 0.0, most)
            return program

        return made

    own_method("sum", build(7.0))
    np.testing.assert_allclose(distribute(problem, "sum").tensions, t, atol=SOLVER)
    own_method("sum", build(5.0))
    assert distribute(problem, "sum").status == TensionStatus.NOT_FOUND


def test_the_command_takes_it_in_this_process(own_method, capsys):
    own_method("even", even)
    with pytest.raises(SystemExit) as ended:
        main(["tension", "acrobot_large", "--method", "even", "--pose", "0.2,0.1,0.3", "--json"])
    assert ended.value.code == 0
    answer = json.loads(printed(capsys).out)
    assert (answer["method"], answer["status"]) == ("even", "feasible")
    assert abs(answer["tensions_n"][0] - answer["tensions_n"][1]) <= 0.1 + SOLVER


def test_names_of_kernels_are_kept(own_method):
    for name in ("quadratic_program", ""):
        with pytest.raises(TensionProblemError, match="accepted: one that no kernel has"):
            own_method(name, even)


def test_a_build_that_gives_no_program_is_refused(own_method):
    own_method("wrong", lambda problem: None)
    with pytest.raises(TensionProblemError, match="build: found NoneType; accepted"):
        distribute(acrobot(RigidTransform(PLACES[0]), 1.0), "wrong")


def test_a_function_that_raises_in_a_loop_ends_it(own_method, capsys):
    def build(problem):
        program = TensionProgram(problem)
        calls = []

        def cost(t):
            calls.append(t)
            if len(calls) > 1:
                raise ZeroDivisionError("own function")
            return float(t @ t)

        program.AddCost(cost)
        return program

    own_method("faulty", build)
    with pytest.raises(TensionProblemError, match="faulty: its program raised an error"):
        distribute(acrobot(RigidTransform(PLACES[0]), 1.0), "faulty")
    assert "own function" in printed(capsys).err
