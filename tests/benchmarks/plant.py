"""The compiled engine and the loop without a diagram against Drake's plant in a Simulator."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.runs.seeds import run_many
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT, CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from tests.benchmarks.ratios import Ratio, per_call, ratios

ROBOT, SCENARIO = "acrobot_small", "acrobot_pbvs"

STEP, PIECE = 1e-3, 0.04
"""Integration step, and time between events, a frame of a camera [s]."""

DURATION = 9.0
"""Simulated time of a run of the scenario [s]."""

WAYS = {
    "compiled loop": "integration.loop=compiled",
    "compiled engine in a diagram": "integration.engine=compiled",
    "plant in a diagram": "integration.engine=plant",
}


def benchmark() -> Iterator[Ratio]:
    """A simulated second of a robot, then one of many runs of a visual servo, with its summary."""
    robot, rule = load_robot(ROBOT), StepRule(method="runge_kutta3", max_step=STEP)
    implicit = StepRule(method=SEMI_IMPLICIT, max_step=STEP)
    blocks: dict[str, CableRobot | CompiledCableRobot] = {
        "compiled robot, held commands": CompiledCableRobot(robot, rule=rule, command_period=HELD),
        "compiled robot, held commands, semi_implicit": CompiledCableRobot(
            robot, rule=implicit, command_period=HELD
        ),
        "compiled robot, commands of each step": CompiledCableRobot(robot, rule=rule),
        "the plant, same step": CableRobot(robot),
    }
    yield from ratios({name: _second(block) for name, block in blocks.items()})
    options = ["camera.kind=projected", f"duration={DURATION}"]
    scenarios = {way: load_scenario(SCENARIO, [*options, word]) for way, word in WAYS.items()}

    def run(scenario: Scenario) -> Callable[[], float]:
        return per_call(lambda: run_many([scenario], 1, traces=True))

    yield from ratios({f"servo run, {way}": run(case) for way, case in scenarios.items()}, 5)


def _second(block: CableRobot | CompiledCableRobot) -> Callable[[], float]:
    """Processor time of a simulated second at rest with halted winches [s]."""
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, block.robot.home.transform())
    commands = block.GetInputPort("cable_velocities")
    commands.FixValue(context, np.zeros(commands.size()))
    if isinstance(block, CableRobot):
        ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP).set_fixed_step_mode(True)
    simulator.Initialize()

    def advance() -> None:
        start = context.get_time()
        for number in range(round(1.0 / PIECE)):
            simulator.AdvanceTo(start + (number + 1) * PIECE)

    return per_call(advance)
