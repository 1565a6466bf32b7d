"""What the tests of controllers share: plants made once, runs of scenarios, ports as rows."""

from functools import cache

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

PROJECTED = "camera.kind=projected"

COMPILED = ("integration.engine=compiled", "integration.loop=compiled")
"""The loop of kernels, whose runs are those of the diagram (tests of `loops`)."""


@cache
def in_plant(name):
    """A robot alone in a finalized plant; contexts are made by each test."""
    plant = MultibodyPlant(0.0)
    handles = add_robot(plant, load_robot(name))
    plant.Finalize()
    return handles


def servo_run(name, *changes):
    return ServoRun(load_scenario(name, [PROJECTED, *changes])).simulate()


def compiled_run(name, *changes):
    return servo_run(name, *COMPILED, *changes)


def tension_run(name, *changes):
    return TensionRun(load_scenario(name, changes)).simulate()


def ports(block):
    """Names and sizes of a system's inputs and outputs."""
    inputs = [block.get_input_port(i) for i in range(block.num_input_ports())]
    outputs = [block.get_output_port(i) for i in range(block.num_output_ports())]
    return tuple({port.get_name(): port.size() for port in group} for group in (inputs, outputs))


def steps_source(*rows, times):
    """A source of numbers that jump to the next row at each time, from 0 s on."""
    held = np.array([*rows, rows[-1]]).T
    return TrajectorySource(PiecewisePolynomial.ZeroOrderHold([0.0, *times, 100.0], held))


def logged(block, sources, names, rate, duration=0.3):
    """Times and outputs of a block whose inputs are given."""
    builder = DiagramBuilder()
    builder.AddSystem(block)
    for name, source in sources.items():
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), block.GetInputPort(name))
    logs = [LogVectorOutput(block.GetOutputPort(name), builder, 1.0 / rate) for name in names]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    found = [log.FindLog(simulator.get_context()) for log in logs]
    return found[0].sample_times(), [log.data().T for log in found]
