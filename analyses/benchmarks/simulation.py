"""Benchmarks of the simulation: the cable kernel, the plant with cables, the closed loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from cdpr_drake.analyses.benchmarks.bridge import bridge_rows
from cdpr_drake.analyses.benchmarks.dynamic_loops import dynamic_rows
from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    processor_seconds,
    real_time_row,
    seconds_per_call,
)
from cdpr_drake.analyses.simulation.monte_carlo import run_many
from cdpr_drake.analyses.simulation.run_loop import REPORT_PERIOD
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.straight_kernel import floating_force
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_in_plant import RobotInPlant, add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.cameras.camera_settings import REGION
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import check_loop, choose_compiled_loop
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT, automatic_step, holding_tensions
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.route_assembly import connect_cables
from cdpr_drake.systems.robots.route_forces import RouteForces, RouteSpatialForces
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.robots.winches import VelocityWinch
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

ROBOT = "acrobot_small"
SCENARIO = "acrobot_pbvs"
PROJECTED, RENDERED = "camera.kind=projected", "camera.kind=rendered"
LAPS = "acrobot_mobile_robot"
WARM = 0.2
"""Simulated time after which everything is compiled [s]."""

STEP, PIECE = 1e-3, 0.04
"""Integration step where engines are compared, and time between their events, a frame [s]."""

EFFECTS = {
    "straight cables": ("acrobot_pbvs", ()),
    "pulleys": ("acrobot_pulleys", ()),
    "pulleys, damped elasticity, friction": ("acrobot_friction", ("cables.pulleys=true",)),
    "pulleys, undamped elasticity, friction": ("acrobot_elastic", ()),
    "catenary, pulleys": ("acrobot_pulleys", ("cables.model=catenary",)),
    "CAROCA, straight cables": ("caroca_pbvs", ("cables.model=kelvin_voigt",)),
    "CAROCA, catenary, pulleys": ("caroca_catenary", ()),
}
"""What is on, and the scenario with overrides that has it; the camera is projected."""


def simulation_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times less and does without the rendered camera."""
    repeats = 3 if quick else 9
    piece = 0.2 if quick else 1.0
    rows = [kernel_row(repeats), plant_row(repeats, piece), *route_rows(repeats, piece)]
    rows += [compiled_row(method, repeats, piece) for method in ("runge_kutta3", SEMI_IMPLICIT)]
    rows += dynamic_rows(quick)
    rows += bridge_rows(quick)
    duration = 1.0 if quick else 9.0
    rows.append(loop_row(", projected camera", SCENARIO, [PROJECTED], duration, 3))
    compiled = [PROJECTED, f"integration.engine={COMPILED}"]
    rows.append(loop_row(", projected camera, compiled", SCENARIO, compiled, duration, 3))
    rows += repeated_rows(duration, 2 if quick else 5)
    rows.append(events_row(duration, 3 if quick else 15))
    rows.append(laps_row(4.0 if quick else 48.0, 2 if quick else 3))
    if not quick:
        rows.append(loop_row(", rendered camera", SCENARIO, [RENDERED], duration, 1))
        rows.append(region_row(duration, 3))
    return rows


def numpy_force(state: Array, l0: Array, l0_dot: Array, cables: Array) -> Array:
    """What `floating_force` computes, as one writes it in NumPy; shape (6,) [N m, N]."""
    w, x, y, z = state[:4] / np.linalg.norm(state[:4])
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    arms = cables[:, 3:6] @ R.T
    vectors = state[4:7] + arms - cables[:, :3]
    lengths = np.linalg.norm(vectors, axis=1)
    u = vectors / lengths[:, None]
    rates = np.sum(u * (state[10:13] + np.cross(state[7:10], arms)), axis=1)
    strain = lengths / l0 - 1.0
    strain_rate = (rates - lengths * l0_dot / l0) / l0
    t = np.maximum(cables[:, 6] * (strain + cables[:, 7] * strain_rate), 0.0) * (strain > 0.0)
    forces = -t[:, None] * u
    return np.concatenate([np.cross(arms, forces).sum(axis=0), forces.sum(axis=0)])


def kernel_row(repeats: int) -> TimingRow:
    """The numba kernel against plain NumPy, one call for all cables."""
    robot = load_robot(ROBOT)
    straight = robot.cable_set().without_pulleys()
    cables = straight.packed()
    X_WP = robot.home.transform()
    l0 = 0.999 * cable_lengths(X_WP, straight.p_WA, straight.p_PB)
    l0_dot = np.zeros_like(l0)
    state = np.concatenate([[1.0, 0.0, 0.0, 0.0], X_WP.translation(), np.full(6, 0.1)])
    out = np.zeros(6)
    fast, slow = interleaved(
        [
            lambda: seconds_per_call(
                lambda: floating_force(state, l0, l0_dot, cables, 0, out), 5000
            ),
            lambda: seconds_per_call(lambda: numpy_force(state, l0, l0_dot, cables), 500),
        ],
        repeats,
    )
    return TimingRow(
        "cable force kernel",
        1e6 * fast,
        "us/call",
        "plain NumPy",
        1e6 * slow,
        slow / fast,
        ratio_means="times faster than NumPy",
    )


class _NoForces(LeafSystem):
    """The ports of `CableForces` and a callback that does nothing: what Python alone costs."""

    def __init__(self, in_plant: RobotInPlant) -> None:
        super().__init__()
        m = len(in_plant.robot.cables)
        plant = in_plant.plant
        size = plant.num_multibody_states(in_plant.model_instance)
        self.DeclareVectorInputPort("platform_state", size)
        self.DeclareVectorInputPort("unstrained_lengths", m)
        self.DeclareVectorInputPort("unstrained_length_rates", m)
        zeros = BasicVector(np.zeros(plant.num_velocities()))
        self.DeclareVectorOutputPort(
            "generalized_force", zeros, self._nothing, {self.all_input_ports_ticket()}
        )

    def _nothing(self, context: Context, output: BasicVector) -> None:
        """Leaves the zeros that the output begins with."""


def plant_simulator(
    make_cables: Callable[[RobotInPlant], LeafSystem], step: float | None = None
) -> Simulator:
    """A robot at rest at its home pose with given cables and halted winches, ready to advance.

    Args:
        make_cables: Makes the cables.
        step: Integration step [s]; None: the automatic one.
    """
    robot = load_robot(ROBOT)
    X_WP = robot.home.transform()
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = add_robot(plant, robot)
    plant.Finalize()
    cables = builder.AddSystem(make_cables(in_plant))
    m = len(robot.cables)
    straight = robot.cable_set().without_pulleys()
    lengths = cable_lengths(X_WP, straight.p_WA, straight.p_PB)
    l0 = unstrained_lengths(lengths, holding_tensions(robot, X_WP, straight), robot.stiffness())
    winches = builder.AddSystem(VelocityWinch(l0, robot.winch.rated_cable_speed()))
    state = plant.get_state_output_port(in_plant.model_instance)
    if cables.HasInputPort("platform_state"):
        builder.Connect(state, cables.GetInputPort("platform_state"))
        applied = cables.GetOutputPort("generalized_force")
        builder.Connect(applied, plant.get_applied_generalized_force_input_port())
    else:
        connect_cables(builder, plant, cables)
    for name in ("unstrained_lengths", "unstrained_length_rates"):
        builder.Connect(winches.GetOutputPort(name), cables.GetInputPort(name))
    builder.ExportInput(winches.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(m))
    simulator = Simulator(diagram, context)
    step = step or automatic_step(robot, X_WP, "runge_kutta3")
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    simulator.Initialize()
    return simulator


def compiled_simulator(method: str, step: float) -> Simulator:
    """The robot of `plant_simulator(CableForces)` as a compiled one."""
    robot = load_robot(ROBOT)
    block = CompiledCableRobot(robot, rule=StepRule(method=method, max_step=step))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    simulator.Initialize()
    return simulator


def _seconds_per_second(simulator: Simulator, duration: float) -> float:
    """Processor time to advance by a duration, in pieces of `PIECE`, over that duration."""
    start = simulator.get_context().get_time()
    count = round(duration / PIECE)

    def advance() -> None:
        for number in range(1, count + 1):
            simulator.AdvanceTo(start + number * PIECE)

    return processor_seconds(advance) / duration


def compiled_row(method: str, repeats: int, duration: float) -> TimingRow:
    """The compiled robot against the plant with cables by runge_kutta3, both in steps of 1 ms."""
    simulators = [compiled_simulator(method, STEP), plant_simulator(CableForces, STEP)]
    compiled, plant = interleaved(
        [lambda s=s: _seconds_per_second(s, duration) for s in simulators],  # type: ignore[misc]
        repeats,
    )
    return TimingRow(
        f"compiled robot, {method}",
        1e3 * compiled,
        "ms/simulated s",
        "plant with cables, same step of 1 ms",
        1e3 * plant,
        plant / compiled,
        ratio_means="times faster than the plant",
    )


def route_rows(repeats: int, duration: float) -> list[TimingRow]:
    """Cables between any bodies against those of one platform, the robot being the same."""

    def routes(in_plant: RobotInPlant) -> CableRoutes:
        cables = in_plant.robot.cable_set().without_pulleys()
        return CableRoutes.of_cable_set(cables, int(in_plant.body_index))

    makers = (
        CableForces,
        lambda in_plant: RouteForces(in_plant.plant, routes(in_plant)),
        lambda in_plant: RouteSpatialForces(in_plant.plant, routes(in_plant)),
    )
    simulators = [plant_simulator(make, STEP) for make in makers]
    platform, *others = interleaved(
        [lambda s=s: _seconds_per_second(s, duration) for s in simulators],  # type: ignore[misc]
        repeats,
    )
    names = ("compiled joints", "spatial forces on bodies")
    return [
        TimingRow(
            f"cables between any bodies, {name}",
            1e3 * other,
            "ms/simulated s",
            "cables of one platform, same step of 1 ms",
            1e3 * platform,
            other / platform,
            ratio_means="times the time of one platform's",
        )
        for name, other in zip(names, others, strict=True)
    ]


def plant_row(repeats: int, duration: float) -> TimingRow:
    """The plant with cables against the same plant whose cable system does nothing."""

    def advance(simulator: Simulator) -> float:
        goal = simulator.get_context().get_time() + duration
        return processor_seconds(lambda: simulator.AdvanceTo(goal)) / duration

    simulators = [plant_simulator(CableForces), plant_simulator(_NoForces)]
    cables, floor = interleaved([lambda s=s: advance(s) for s in simulators], repeats)  # type: ignore[misc]
    return TimingRow(
        "plant with cables",
        1e3 * cables,
        "ms/simulated s",
        "floor: cable system does nothing",
        1e3 * floor,
        cables / floor,
        ratio_means="times the floor",
    )


def loop_row(
    name: str, scenario: str, overrides: Sequence[str], duration: float, repeats: int
) -> TimingRow:
    """The closed loop of a scenario; its ratio is the real-time factor."""
    times = (f"duration={duration}", f"stop.hold={duration}")
    loaded = load_scenario(scenario, [*overrides, *times])
    results = [run_scenario(loaded) for _ in range(repeats)]
    walls = [result.wall_time for result in results]
    return real_time_row(f"closed loop{name}", results[0].sim_time, walls)


def region_row(duration: float, repeats: int) -> TimingRow:
    """The rendered camera with a region of interest against whole images.

    By processor time, in turns: VTK draws in as many threads as there are cores.
    """
    whole_images = [RENDERED, f"duration={duration}", f"stop.hold={duration}"]
    ways = (whole_images, [*whole_images, f"camera.region={REGION}"])
    scenarios = [load_scenario(SCENARIO, way) for way in ways]

    def once(scenario: Scenario) -> float:
        return processor_seconds(lambda: run_scenario(scenario))

    whole, region = interleaved([lambda s=s: once(s) for s in scenarios], repeats)  # type: ignore[misc]
    return TimingRow(
        "closed loop, rendered camera, region of interest",
        duration / region,
        "s per second of processor time",
        "whole images",
        duration / whole,
        whole / region,
        ratio_means="times the real-time factor",
    )


def repeated_rows(duration: float, repeats: int) -> list[TimingRow]:
    """One of many runs over seeds by the compiled loop, against diagrams: summary and all.

    By processor time, in turns, so that what else the machine does counts little.
    """
    times = [PROJECTED, f"duration={duration}"]
    diagrams = {
        "plant in a diagram": ["integration.engine=plant"],
        "compiled engine in a diagram": [f"integration.engine={COMPILED}"],
    }
    ways = [*diagrams.values(), [f"integration.loop={COMPILED}"]]
    scenarios = [load_scenario(SCENARIO, [*times, *way]) for way in ways]
    run_many(scenarios, 1)  # loads kernels

    def once(scenario: Scenario) -> float:
        return processor_seconds(lambda: run_many([scenario], 1, keep_traces=True))

    *slow, fast = interleaved([lambda s=s: once(s) for s in scenarios], repeats)  # type: ignore[misc]
    return [
        TimingRow(
            "one of repeated runs, compiled loop",
            1e3 * fast,
            "ms of processor time",
            words,
            1e3 * other,
            other / fast,
            ratio_means="times faster than the diagram",
        )
        for words, other in zip(diagrams, slow, strict=True)
    ]


def events_row(duration: float, repeats: int) -> TimingRow:
    """A loop whose kernel goes from event to event, against the same loop in Python; made anew
    each time, without summary. By processor time, in turns."""
    options = [PROJECTED, f"duration={duration}", f"integration.loop={COMPILED}"]
    scenario = check_loop(load_scenario(SCENARIO, options))

    def once(in_python: bool) -> None:
        loop = ServoLoop(scenario)
        if in_python:
            loop.python_reason = "a benchmark asks for it"
        loop.start()
        while loop.time < duration and loop.outcome == Outcome.RUNNING:
            loop.advance_to(min(loop.time + REPORT_PERIOD, duration))

    once(False)  # loads kernels
    kernel, python = interleaved(
        [lambda way=way: processor_seconds(lambda: once(way)) for way in (False, True)],  # type: ignore[misc]
        repeats,
    )
    return TimingRow(
        "servo loop, events in one kernel",
        1e3 * kernel,
        "ms of processor time",
        "its events in Python",
        1e3 * python,
        python / kernel,
        ratio_means="times faster than in Python",
    )


def laps_row(duration: float, repeats: int) -> TimingRow:
    """The tag on a mobile robot, with tension correction, projected camera and real estimator, by
    the compiled loop, against `acrobot_pbvs` by the plant in a diagram.

    By processor time, in turns.
    """
    plant = [PROJECTED, "integration.engine=plant", f"duration={duration}", f"stop.hold={duration}"]
    scenarios = [
        load_scenario(SCENARIO, plant),
        choose_compiled_loop(load_scenario(LAPS, [f"duration={duration}", "log_rate=5"])),
    ]
    for scenario in scenarios:  # loads kernels
        run_scenario(replace(scenario, duration=WARM))

    def once(scenario: Scenario) -> float:
        return processor_seconds(lambda: run_scenario(scenario))

    slow, fast = interleaved([lambda s=s: once(s) for s in scenarios], repeats)  # type: ignore[misc]
    return TimingRow(
        "laps behind a mobile robot, compiled loop",
        duration / fast,
        "s per second of processor time",
        f"{SCENARIO}, projected, plant in a diagram",
        duration / slow,
        slow / fast,
        ratio_means="times the real-time factor",
    )


def effect_rows(quick: bool) -> list[TimingRow]:
    """Closed loops with physical effects; `quick` runs each of them once and shorter."""
    duration, repeats = (0.2, 1) if quick else (8.0, 3)
    return [
        loop_row(f": {name}", scenario, (*overrides, PROJECTED), duration, repeats)
        for name, (scenario, overrides) in EFFECTS.items()
    ]
