"""Robots whose centre of mass and principal axes lie nowhere special, and motions of them."""

import numpy as np
from hypothesis import strategies as st
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot

GAINS = TaskGains((90.0, 120.0), (18.0, 25.0))

number = st.floats(-2.0, 2.0)
triple = st.tuples(number, number, number).map(np.array)
spatial = st.tuples(*[number] * 6).map(np.array)
# Up to 3 rad: at half a turn the sign of the error is not determined.
turn = triple.map(lambda v: v * (3.0 / np.sqrt(12.0)))


def awkward_robot(name):
    """A robot whose centre of mass and principal axes lie nowhere special."""
    robot = load_robot(name)
    robot.platform.center_of_mass = np.array([0.03, -0.05, 0.11])
    robot.platform.inertia = np.array([0.05, 0.07, 0.06, 0.004, -0.006, 0.003])
    return robot


def plant_of(robot):
    plant = MultibodyPlant(0.0)
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    return plant, in_plant, plant.CreateDefaultContext()
