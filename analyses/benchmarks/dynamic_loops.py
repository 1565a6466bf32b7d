"""Benchmarks of dynamic control at 1 kHz: computed torque, exact tensions, motion and log.

All ways close the same loop, on the same robot along the same trajectory; their times are those of
the processor, taken in turns.
"""

from __future__ import annotations

from collections.abc import Callable

from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.benchmarks.tendon_loop import TendonLoop, has_tendons
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop
from cdpr_drake.systems.robots.settings import COMPILED, PLANT, DampingSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario

SCENARIO = "caroca_computed_torque"


def dynamic_scenario(engine: str) -> TensionScenario:
    """The scenario, its robot moved by an engine."""
    scenario = load_scenario(SCENARIO, [f"integration.engine={engine}"])
    assert isinstance(scenario, TensionScenario)
    return scenario


def dynamic_control(scenario: TensionScenario) -> TensionControl:
    """The blocks of the scenario with its log."""
    settings = TensionControlSettings(
        trajectory=scenario.trajectory.trajectory(),
        gains=scenario.controller.gains(),
        method=scenario.distribution.method,
        limits=scenario.limits(),
        rate=scenario.controller.rate,
        rule=scenario.step_rule(),
        damping=DampingSettings(translation=0.0, rotation=0.0),  # as the MuJoCo model
    )
    return build_tension_control(load_robot(scenario.robot), settings, log_rate=scenario.log_rate)


def diagram_simulator(engine: str) -> Simulator:
    """A simulator of the scenario at the start of its trajectory."""
    scenario = dynamic_scenario(engine)
    control, integration = dynamic_control(scenario), scenario.integration
    simulator = Simulator(control.diagram, control.make_context())
    ResetIntegratorFromFlags(
        simulator, integration.integrator, integration.max_step
    ).set_fixed_step_mode(True)
    simulator.Initialize()
    return simulator


def compiled_loop() -> TensionLoop:
    """The compiled loop of the scenario at the start of its trajectory."""
    scenario = dynamic_scenario(COMPILED)
    return TensionLoop(dynamic_control(scenario), scenario.log_rate)


def tendon_loop() -> TendonLoop:
    """The same in MuJoCo with daqp."""
    scenario = dynamic_scenario(PLANT)
    robot = load_robot(scenario.robot)
    start = scenario.trajectory.trajectory().pose(0.0)
    problem = tension_problem(
        robot, start, limits=scenario.limits(), cables=scenario.believed_cables(robot)
    )
    return TendonLoop(scenario, robot, problem)


def _advancers() -> dict[str, Callable[[float], None]]:
    """What advances each way by a time [s], by its name."""
    loop = compiled_loop()
    ways: dict[str, Callable[[float], None]] = {
        "compiled as a whole": lambda time: loop.advance_to(loop.time + time)
    }

    def by(simulator: Simulator) -> Callable[[float], None]:
        context = simulator.get_context()
        return lambda time: simulator.AdvanceTo(context.get_time() + time) and None

    ways["through the diagram, compiled robot"] = by(diagram_simulator(COMPILED))
    ways["through the diagram, plant"] = by(diagram_simulator(PLANT))
    if has_tendons():
        tendons = tendon_loop()
        ways["MuJoCo with daqp"] = lambda time: tendons.advance(round(1000 * time))
    return ways


def dynamic_rows(quick: bool) -> list[TimingRow]:
    """Each way against MuJoCo with daqp where they are installed, else against the plant."""
    repeats, duration = (3, 0.2) if quick else (9, 1.0)
    ways = _advancers()
    times = dict(
        zip(
            ways,
            interleaved(
                [
                    lambda advance=advance: (  # type: ignore[misc]
                        processor_seconds(lambda: advance(duration)) / duration
                    )
                    for advance in ways.values()
                ],
                repeats,
            ),
            strict=True,
        )
    )
    baseline = list(ways)[-1]
    other = times.pop(baseline)
    return [
        TimingRow(
            f"dynamic loop, 1 kHz, {name}",
            1e3 * time,
            "ms/simulated s",
            f"the same loop, {baseline}",
            1e3 * other,
            other / time,
            ratio_means="times as fast",
        )
        for name, time in times.items()
    ]
