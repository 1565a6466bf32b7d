"""Copies of batches and of environments: they go on alike, and on arrays of their own."""

import copy
import pickle

import numpy as np
import pytest

from cdpr_drake.analyses.front.environments import environment_names, make_environment
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from tests.systems.batches.varied import settings, varied

PERIOD = 0.02
WAYS = [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))]


def by_robots(batch):
    return np.concatenate([batch.states.ravel(), batch.tensions.ravel()])


@pytest.mark.parametrize("copied", WAYS)
@pytest.mark.parametrize("how", [{}, {"settings": settings("torque")}, {"by_tensions": True}])
def test_a_copied_batch_goes_on_as_the_original(how, copied):
    robot = BatchRobots("acrobot_small", 1).robot
    batch = BatchRobots(robot, 3, parameters=varied(robot, 3), threads=1, **how)
    batch.step(np.full(8, 0.01), PERIOD)
    other = copied(batch)
    before = by_robots(batch)
    np.testing.assert_array_equal(by_robots(other), before)
    other.step(np.full(8, -0.01), PERIOD)
    np.testing.assert_array_equal(by_robots(batch), before)
    batch.step(np.full(8, -0.01), PERIOD)
    np.testing.assert_array_equal(by_robots(batch), by_robots(other))


def seen(step):
    observation, reward, *_ = step
    parts = observation.values() if isinstance(observation, dict) else [observation]
    return np.concatenate([np.ravel(part) for part in parts] + [[reward]])


@pytest.mark.parametrize("copied", WAYS)
@pytest.mark.parametrize("name", environment_names())
def test_a_copied_environment_goes_on_as_the_original(name, copied):
    environment = make_environment(name)
    environment.reset(seed=3)
    environment.action_space.seed(3)
    actions = [environment.action_space.sample() for _ in range(4)]
    environment.step(actions[0])
    ahead = copied(environment)
    for action in actions[3:0:-1]:
        ahead.step(action)
    other = copied(environment)
    for action in actions:
        np.testing.assert_array_equal(seen(other.step(action)), seen(environment.step(action)))
