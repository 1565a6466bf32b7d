"""pydrake's environment for learning, with either engine: SetTime(0), Initialize, reset."""

import gymnasium
import numpy as np
import pytest
from pydrake.gym import DrakeGymEnv
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from tests.systems.robots.engines import made

STEP = 1e-3
"""Of the integration [s]; fixed, since an integrator that chooses steps remembers the last one."""

SAME_STEPS = 1e-9
"""Difference of states where both engines take the same steps by the same method: rounding."""


def environment(kind, reset_handler):
    robot = load_robot("acrobot_small")
    block = made(kind, robot)
    simulator = Simulator(block)
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(max_step=STEP))

    def hang(_simulator, context, _seed):
        block.set_at_equilibrium(context, robot.home.transform())

    return DrakeGymEnv(
        simulator=simulator,
        time_step=0.05,
        action_space=gymnasium.spaces.Box(-0.1, 0.1, (8,)),
        observation_space=gymnasium.spaces.Box(-np.inf, np.inf, (13,)),
        reward=lambda system, context: system.GetOutputPort("X_WP").Eval(context).translation()[2],
        action_port_id="cable_velocities",
        observation_port_id="platform_state",
        reset_handler=hang if reset_handler else None,
    )


def episode(env):
    states = [env.reset(seed=3)[0]]
    total = 0.0
    for k in range(6):
        action = 0.02 * np.sin(np.arange(8.0) + k)
        state, reward, terminated, truncated, _ = env.step(action)
        assert not terminated
        assert not truncated
        states.append(state)
        total += reward
    return np.array(states), total


@pytest.mark.parametrize("reset_handler", [True, False], ids=["hung", "default"])
@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
def test_every_episode_begins_where_the_first_did(kind, reset_handler):
    env = environment(kind, reset_handler)
    first, total = episode(env)
    assert np.linalg.norm(first[-1] - first[0]) > 1e-3  # it moved
    for _ in range(2):
        again, also = episode(env)
        assert again.tobytes() == first.tobytes()
        assert also == total


def test_both_engines_give_the_same_episode():
    kinds = (CableRobot, CompiledCableRobot)
    plant, compiled = (episode(environment(kind, True)) for kind in kinds)
    np.testing.assert_allclose(compiled[0], plant[0], atol=SAME_STEPS)


def test_a_robot_stays_where_it_is_when_the_time_is_set_back():
    """As the plant does: its state does not know the time."""
    block = CompiledCableRobot(load_robot("acrobot_small"))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort("cable_velocities").FixValue(context, np.full(8, 0.01))
    simulator.AdvanceTo(0.1)
    simulator.AdvancePendingEvents()
    before = block.GetOutputPort("platform_state").Eval(context).copy()
    context.SetTime(0.0)
    with pytest.raises(RuntimeError, match="set the time first"):
        block.GetOutputPort("platform_state").Eval(context)
    simulator.Initialize()
    assert block.GetOutputPort("platform_state").Eval(context).tobytes() == before.tobytes()
    assert not block.GetOutputPort("steps").Eval(context).any()
    simulator.AdvanceTo(0.1)
    assert block.GetOutputPort("platform_state").Eval(context)[6] < before[6]


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
def test_episodes_of_one_step_follow_their_own_action(kind):
    """The compiled robot remembers what it reached; that is not another episode's."""
    env = environment(kind, True)
    reached = []
    for speed in (0.02, -0.02, 0.02):
        env.reset(seed=3)
        reached.append(env.step(np.full(8, speed))[0])
    assert np.linalg.norm(reached[1] - reached[0]) > 1e-3
    assert reached[2].tobytes() == reached[0].tobytes()
