"""The toy method against its closed form, wherever methods are chosen by name."""

import json

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.methods import distribute, distribute_batch
from tests.messages import printed

SAME = 1e-9
"""The same tensions from other sums [N]."""


@pytest.fixture(scope="module")
def problem():
    robot = load_robot("acrobot_large")
    return tension_problem(robot, robot.home.transform(), limits=(0.5, 60.0))


@pytest.fixture(scope="module")
def expected(problem):
    wanted = problem.lower + 2.0 / 3.0 * (problem.upper - problem.lower)
    return wanted - np.linalg.pinv(problem.W) @ (problem.wrench + problem.W @ wanted)


def test_one_problem(problem, expected):
    solution = distribute(problem, "upper_third")
    assert (solution.method, solution.status) == ("upper_third", "feasible")
    np.testing.assert_allclose(solution.tensions, expected, atol=SAME)
    solution = cdpr.solve_tensions("acrobot_large", method="upper_third", limits=(0.5, 60.0))
    np.testing.assert_allclose(solution.tensions, expected, atol=SAME)
    assert "upper_third" in cdpr.TENSION_METHODS


def test_a_batch(problem, expected):
    wrenches = np.stack([problem.wrench, -problem.wrench])
    t, codes = distribute_batch(
        np.stack([problem.W] * 2), wrenches, problem.lower, problem.upper, "upper_third"
    )
    np.testing.assert_array_equal(codes, [1, -1])
    np.testing.assert_allclose(t[0], expected, atol=SAME)
    assert np.all(np.isnan(t[1]))


def test_the_block(problem, expected):
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, load_robot("acrobot_large"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    in_plant.set_pose(context, in_plant.robot.home.transform())
    state = plant.get_state_output_port(in_plant.model_instance).Eval(context)
    block = TensionDistributor(in_plant, "upper_third", limits=(0.5, 60.0))
    context = block.CreateDefaultContext()
    block.GetInputPort("platform_state").FixValue(context, state)
    block.GetInputPort("desired_wrench").FixValue(context, -problem.wrench)
    block.CalcForcedDiscreteVariableUpdate(context, context.get_mutable_discrete_state())
    assert block.GetOutputPort("feasible").Eval(context) == 1.0
    np.testing.assert_allclose(block.GetOutputPort("tensions").Eval(context), expected, atol=SAME)


def test_the_command_line_and_scenarios(capsys, expected):
    pose = ",".join(f"{x}" for x in load_robot("acrobot_large").home.transform().translation())
    words = ["tension", "acrobot_large", "--pose", pose, "--method", "upper_third"]
    with pytest.raises(SystemExit) as ended:
        main([*words, "--limits", "0.5,60", "--json"])
    assert ended.value.code == 0
    found = json.loads(printed(capsys).out)
    np.testing.assert_allclose(found["tensions_n"], expected, atol=1e-6)
    scenario = load_scenario("caroca_computed_torque", ["distribution.method=upper_third"])
    assert scenario.distribution.method == "upper_third"
