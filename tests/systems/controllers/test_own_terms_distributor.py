"""The running distributor with a method made of a program: a 1 kHz loop, by the diagram and
without it, against each step's program solved by itself."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.analyses.simulation.tension_control_run import (
    run_tension_scenario,
    summarize_tension_run,
)
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.methods import METHODS, TensionMethod, distribute
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.program import TensionProgram

SCENARIO = "acrobot_computed_torque"
SOLVER = 1e-4  # [N]; of solvers that stop at 1e-8 of the weight, or SNOPT at 1e-6
LOCAL = 1e-2  # [N]; SNOPT from another start, where the cost is flat
BOUND = 0.45  # [N]


def preference(problem):
    program = TensionProgram(problem)
    program.AddQuadraticCost(8.0, 2.0, name="near 8 N")
    return program


def bound(problem):
    program = TensionProgram(problem)
    A = np.kron(np.eye(4), [1.0, -1.0])
    program.AddLinearConstraint(A, -BOUND, BOUND, name="pairs")
    return program


def nonlinear(problem):
    program = TensionProgram(problem)
    program.AddCost(lambda t: 20.0 * float(np.sum(1.0 / t)), name="not slack")
    return program


TERMS = {"preference": preference, "bound": bound, "nonlinear": nonlinear}


@pytest.fixture
def own_method():
    before = set(METHODS)
    yield TensionMethod.from_program
    for name in set(METHODS) - before:
        del METHODS[name]


def scenario(method, seconds, engine="plant"):
    loaded = load_scenario(SCENARIO)
    return replace(
        loaded, duration=seconds, expected=None,
        distribution=replace(loaded.distribution, method=method),
        integration=replace(loaded.integration, engine=engine),
    )  # fmt: skip


@pytest.mark.parametrize("terms", TERMS)
def test_a_loop_of_1_khz_misses_no_step(terms, own_method):
    """Two seconds and more; what was commanded last is what the program gives there by itself."""
    method = own_method(terms, TERMS[terms])
    run = run_tension_scenario(scenario(terms, 0.6 if terms == "nonlinear" else 2.5))
    summary = summarize_tension_run(run)
    told = summary["program_steps"]
    assert summary["infeasible_steps"] == 0
    assert told["missed_steps"] == 0
    assert told["steps"] >= 1000 * run.scenario.duration
    assert told == method.step_times.as_dict()
    assert 0.0 < told["mean_s"] <= told["worst_s"]
    assert summary["position_error_m"]["max"] < 1e-3
    assert np.all(run.log["feasible"][1:] == 1.0)
    t = run.log["tensions"][1:]
    if terms == "bound":
        apart = np.abs(t[:, ::2] - t[:, 1::2])
        assert np.max(apart) <= BOUND + SOLVER
        plain = run_tension_scenario(scenario("quadratic_program", 2.5)).log["tensions"][1:]
        assert np.max(np.abs(plain[:, ::2] - plain[:, 1::2])) > BOUND
    # The wrench that the tensions gave is that of the motion: asked again, by itself.
    robot = run.control.robot
    cables = run.scenario.believed_cables(robot)
    for k in (len(t) // 3, len(t) - 1):
        X = pose_from_row(run.log["X_WP"][k + 1])
        held = tension_problem(robot, X, limits=(1.0, 60.0), cables=cables)
        problem = TensionProblem(held.W, -held.W @ t[k], held.lower, held.upper)
        again = TERMS[terms](problem).Solve().tensions
        np.testing.assert_allclose(t[k], again, rtol=0.0, atol=LOCAL if terms == "nonlinear"
                                   else 10.0 * SOLVER)  # fmt: skip


def test_the_compiled_loop_takes_it_too(own_method):
    own_method("preference", preference)
    runs = [run_tension_scenario(scenario("preference", 0.3, engine)) for engine in
            ("plant", "compiled")]  # fmt: skip
    assert runs[1].loop != runs[0].loop
    for run in runs:
        assert summarize_tension_run(run)["infeasible_steps"] == 0
    ends = [run.log["tensions"][-1] for run in runs]
    np.testing.assert_allclose(ends[0], ends[1], atol=0.05)


def test_kernels_tell_no_time():
    run = run_tension_scenario(scenario("quadratic_program", 0.05))
    assert "program_steps" not in summarize_tension_run(run)


def test_what_excludes_all_tensions_is_held_and_counted(own_method):
    def impossible(problem):
        program = TensionProgram(problem)
        program.AddLinearConstraint(np.ones(8), 0.0, 1.0, name="nothing")
        return program

    method = own_method("impossible", impossible)
    run = run_tension_scenario(scenario("impossible", 0.01))
    summary = summarize_tension_run(run)
    assert summary["infeasible_steps"] == summary["program_steps"]["missed_steps"] >= 10
    assert method.step_times.missed >= 10


def test_terms_that_do_not_fit_are_refused_before_the_loop(own_method):
    def wrong(problem):
        program = TensionProgram(problem)
        program.AddLinearConstraint(np.ones(4), 0.0, 1.0)
        return program

    own_method("wrong", wrong)
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot("acrobot_large"))
    plant.Finalize()
    with pytest.raises(TensionProblemError, match=r"A: found shape \(1, 4\)"):
        TensionDistributor(in_plant, "wrong")
    problem = tension_problem(load_robot("acrobot_large"), in_plant.robot.home.transform())
    with pytest.raises(TensionProblemError, match=r"A: found shape \(1, 4\)"):
        distribute(problem, "wrong")
