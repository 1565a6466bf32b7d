"""The block that distributes: ports, held tensions, counted failures, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.control.force_balance import FORCE, force_problem
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.tensions.methods import METHODS, distribute

ROUNDING = 1e-9
"""Of the tensions of the largest robot, relative."""


def in_plant(name):
    plant = MultibodyPlant(0.0)
    handles = add_robot(plant, load_robot(name))
    plant.Finalize()
    return handles


def home_state(handles):
    context = handles.plant.CreateDefaultContext()
    handles.set_pose(context, handles.robot.home.transform())
    return handles.plant.get_state_output_port(handles.model_instance).Eval(context)


def step(block, context, wrench):
    block.GetInputPort("desired_wrench").FixValue(context, wrench)
    updated = context.Clone()
    block.CalcForcedDiscreteVariableUpdate(context, updated.get_mutable_discrete_state())
    context.SetTimeStateAndParametersFrom(updated)
    return {name: block.GetOutputPort(name).Eval(context).copy() for name in
            ("tensions", "feasible", "failures")}  # fmt: skip


def weight_held(handles):
    """The wrench that carries the platform's weight, all six components."""
    robot = handles.robot
    problem = tension_problem(robot, robot.home.transform())
    wrench = np.zeros(6)
    rows = [2, 3, 4] if robot.is_planar() else list(range(6))
    wrench[rows] = -problem.wrench
    return problem, wrench


def test_ports_are_public():
    block = TensionDistributor(in_plant("acrobot_large"))
    inputs = [block.get_input_port(i).get_name() for i in range(block.num_input_ports())]
    outputs = [block.get_output_port(i).get_name() for i in range(block.num_output_ports())]
    assert inputs == ["platform_state", "desired_wrench"]
    assert outputs == ["tensions", "feasible", "failures"]


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
@pytest.mark.parametrize("method", list(METHODS))
def test_step_is_the_method(name, method):
    handles = in_plant(name)
    problem, wrench = weight_held(handles)
    if not METHODS[method].takes(problem.redundancy):
        with pytest.raises(TensionProblemError, match="redundancy"):
            TensionDistributor(handles, method)
        return
    reference = np.full(problem.W.shape[1], 6.0) if METHODS[method].needs_reference else None
    problem = tension_problem(handles.robot, handles.robot.home.transform(), reference=reference)
    block = TensionDistributor(handles, method, reference=reference)
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, home_state(handles))
    found = step(block, context, wrench)
    expected = distribute(problem, method)
    assert found["feasible"] == (expected.status == "feasible")
    if expected.status == "feasible":
        np.testing.assert_allclose(found["tensions"], expected.tensions, rtol=ROUNDING, atol=1e-9)


@pytest.mark.parametrize(("name", "turns"), [("acrobot_large", 3), ("planar", 1)])
@pytest.mark.parametrize("method", list(METHODS))
def test_forces_alone_are_balanced_by_every_method_that_takes_the_redundancy(name, turns, method):
    """Others are refused in one line; the moments that are asked for count for nothing."""
    handles = in_plant(name)
    _, wrench = weight_held(handles)
    reference = np.full(len(handles.robot.cables), 6.0)
    whole = tension_problem(handles.robot, handles.robot.home.transform(), reference=reference)
    problem = force_problem(whole, turns)
    if not METHODS[method].takes(problem.redundancy):
        accepted = f"{method}: found redundancy m - n = {problem.redundancy}; accepted: "
        with pytest.raises(TensionProblemError, match=accepted) as refused:
            TensionDistributor(handles, method, balance=FORCE)
        assert "\n" not in str(refused.value)
        return
    block = TensionDistributor(handles, method, reference=reference, balance=FORCE)
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, home_state(handles))
    wrench[:3] = 1e3
    found = step(block, context, wrench)
    expected = distribute(problem, method)
    assert found["feasible"] == (expected.status == "feasible")
    if expected.status == "feasible":
        np.testing.assert_allclose(found["tensions"], expected.tensions, rtol=ROUNDING, atol=1e-9)
        left = whole.residual(found["tensions"]), problem.residual(found["tensions"])
        assert left[1] < ROUNDING


def test_what_cannot_be_met_holds_the_last_tensions_and_is_counted():
    handles = in_plant("acrobot_large")
    _, wrench = weight_held(handles)
    block = TensionDistributor(handles, limits=(0.5, 60.0))
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, home_state(handles))
    np.testing.assert_array_equal(block.GetOutputPort("tensions").Eval(context), 0.5)
    good = step(block, context, wrench)
    assert good["feasible"] == 1.0
    for count in (1.0, 2.0):
        bad = step(block, context, -wrench)  # a suspended robot cannot push down
        assert bad["feasible"] == 0.0
        assert bad["failures"] == count
        np.testing.assert_array_equal(bad["tensions"], good["tensions"])
    again = step(block, context, wrench)
    assert again["feasible"] == 1.0
    assert again["failures"] == 2.0


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_slack_relaxed_answers_what_cannot_be_met(name):
    """With the tensions that `distribute` gives, within limits; it counts as not met."""
    handles = in_plant(name)
    problem, wrench = weight_held(handles)
    far = 1000.0 * np.ones(6)
    rows = [2, 3, 4] if handles.robot.is_planar() else list(range(6))
    asked = tension_problem(handles.robot, handles.robot.home.transform())
    asked = replace(asked, wrench=-far[rows])
    block = TensionDistributor(handles, "slack_relaxed")
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, home_state(handles))
    found = step(block, context, far)
    assert found["feasible"] == 0.0
    assert found["failures"] == 1.0
    expected = distribute(asked, "slack_relaxed").tensions
    assert np.max(expected) == np.max(problem.upper)
    np.testing.assert_allclose(found["tensions"], expected, rtol=ROUNDING, atol=1e-9)
    assert step(block, context, wrench)["feasible"] == 1.0


def test_refusals():
    handles = in_plant("acrobot_large")
    with pytest.raises(TensionProblemError, match="method: found foo"):
        TensionDistributor(handles, "foo")
    with pytest.raises(TensionProblemError, match="lower <= upper"):
        TensionDistributor(handles, limits=(9.0, 1.0))
    with pytest.raises(TensionProblemError, match="no reference"):
        TensionDistributor(handles, "reference_program")
