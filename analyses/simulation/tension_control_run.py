"""Runs a scenario of dynamic control by tensions, and writes what it did."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator, SimulatorStatus

from cdpr_drake.analyses.frame.figures import (
    draw_curve,
    figure_writers,
    new_figure,
    shade,
)
from cdpr_drake.analyses.frame.thinning import by_pieces, path_rows
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.log_files import LogNames, finite, spread, write_json, write_log
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.reporting.provenance import package_versions, write_run_inputs
from cdpr_drake.analyses.simulation.force_report import (
    feels_forces,
    force_figure,
    force_summary,
)
from cdpr_drake.analyses.simulation.run_loop import (
    LONGEST_WARM_UP,
    EndedRun,
    advance,
    ended,
    fixed_step_simulator,
    go_on,
    left_unfinished,
)
from cdpr_drake.analyses.simulation.session import (
    DEFAULT_SESSION,
    RunSession,
    check_connected,
    resting,
)
from cdpr_drake.analyses.simulation.start_checks import limit_warnings
from cdpr_drake.analyses.simulation.unexpected_end import tension_control_message
from cdpr_drake.analyses.simulation.worlds import (
    world_columns,
    world_figure,
    world_summary,
    world_words,
)
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import Surroundings
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CableGeometryError, DivergedError, ScenarioError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import ANGLE, DESIRED, DISTANCE, PLATFORM
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.predictive_tensions import PredictiveTensions
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.loops.remote_tension_loop import RemoteTensionLoop, can_be_stepped
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.remote.remote_place import DISTRIBUTOR
from cdpr_drake.systems.robots.settings import CableSettings, simulated_model
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.scenarios.run_settings import engine_of
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario

COMPILED_LOOP, DIAGRAM, REMOTE_LOOP = "compiled", "diagram", "remote"
"""What went from control step to control step: one compiled loop, Drake's simulator, or compiled
steps with a process outside in between."""


@dataclass(frozen=True, kw_only=True)
class TensionRun(EndedRun):
    """What a run did; its outcome is COMPLETED, CONTACT, DIVERGED or INTERRUPTED.

    Attributes:
        scenario: The scenario.
        control: The diagram and its handles.
        loop: `COMPILED_LOOP`, `DIAGRAM` or `REMOTE_LOOP`; None where it is not known.
    """

    scenario: TensionScenario
    control: TensionControl
    loop: str | None = None


def make_control(scenario: TensionScenario) -> TensionControl:
    """The diagram of a scenario, with its log; raises what `build_tension_control` does.

    Raises:
        ScenarioError: The scenario is not one of dynamic control.
    """
    if not isinstance(scenario, TensionScenario):
        raise ScenarioError(
            f"{scenario.name}: kind: found {scenario.kind}; accepted: {TENSION_CONTROL}; for this "
            "one use cdpr_drake.analyses.simulation.run_scenario"
        )
    robot, belief = load_robot(scenario.robot), scenario.perturbations.believed_robot
    believed = robot if belief is None else load_robot(belief)
    damping = scenario.damping.of(robot) if belief is None else None
    dynamics = platform_dynamics(believed, damping=damping)
    trajectory, distributor = scenario.trajectory.trajectory(), TensionControlSettings.distributor
    if scenario.predictive is not None:
        ahead, view = scenario.predictive.steps, scenario.predictive.view(robot)
        distributor = PredictiveTensions(trajectory, ahead, view, dynamics)
    return build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=trajectory,
            gains=scenario.controller.gains(),
            method=scenario.distribution.method,
            limits=scenario.limits(),
            rate=scenario.controller.rate,
            reference=scenario.reference_tensions(robot),
            cables=scenario.cable_set(robot),
            believed_cables=scenario.believed_cables(believed),
            dynamics=dynamics,
            balance=scenario.controller.balance,
            rule=scenario.step_rule(),
            remote=None if scenario.remote is None else scenario.remote.place,
            distributor=distributor,
            world=scenario.world,
            stop_at_contact=scenario.stop.contact,
            force=scenario.force_control,
            disturbances=scenario.disturbances,
            seed=scenario.seed,
            damping=scenario.damping,
        ),
        log_rate=scenario.log_rate,
    )


def run_tension_scenario(
    scenario: TensionScenario, session: RunSession = DEFAULT_SESSION, **how: Any
) -> TensionRun:
    """Simulates a scenario to the end of its duration; arguments as `run_scenario`.

    The run has diverged when the platform leaves the frame or its state is not finite.

    By the engine compiled the whole loop is one compiled call, with the same numbers, unless
    `session.prepare` wants to look into the diagram.
    """
    session = session.having(how)
    control = make_control(scenario)
    check_connected(scenario, session.connect)
    looks = session.prepare is not None or session.resume
    if not looks and (can_be_compiled(control) or can_be_stepped(control)):
        return _run_loop(control, scenario, session)
    # Loads compiled kernels. Where it diverges, the run will, and keeps what it has logged.
    with suppress(CableGeometryError, RuntimeError), resting(control.remote):
        warm = make_simulator(control, scenario)
        warm.AdvanceTo(min(2.0 / scenario.controller.rate, scenario.duration, LONGEST_WARM_UP))
    _count_anew(control)
    simulator = make_simulator(control, scenario)
    session.begin(simulator, control.diagram, control.remote)
    context = simulator.get_mutable_context()
    assert control.log is not None
    keeper = session.keeper(
        control.log, context, control.read_log, scenario, remote=control.remote
    )  # fmt: skip
    end = advance(
        simulator,
        scenario.duration,
        lambda status: _outcome(
            scenario, control, control.pose(context), context.get_time(), status
        ),
        lambda: control.errors(context),
        session,
        keeper,
    )
    return TensionRun(
        **ended(end, keeper, context.get_time()), scenario=scenario, control=control, loop=DIAGRAM
    )


def _run_loop(
    control: TensionControl, scenario: TensionScenario, session: RunSession
) -> TensionRun:
    """`run_tension_scenario` without the diagram."""
    make = TensionLoop if control.remote is None else RemoteTensionLoop
    with suppress(CableGeometryError, DivergedError), resting(control.remote):  # as above
        make(control, scenario.log_rate).advance_to(1.0 / scenario.controller.rate)
    _count_anew(control)
    session.join(control.remote)
    loop = make(control, scenario.log_rate)
    keeper = session.keeper(loop, None, loop.read_log, scenario, remote=control.remote)

    def step(until: float) -> Outcome:
        loop.advance_to(min(until, scenario.duration))
        return _outcome(scenario, control, loop.pose(), loop.time)

    end = go_on(lambda: loop.time, step, loop.errors, session, keeper)
    return TensionRun(
        **ended(end, keeper, loop.time),
        scenario=scenario,
        control=control,
        loop=COMPILED_LOOP if control.remote is None else REMOTE_LOOP,
    )


def _count_anew(control: TensionControl) -> None:
    """Steps of the run alone count, not those that load compiled kernels."""
    times = control.blocks.distributor.step_times
    if times is not None:
        times.restart(times.period)


def _outcome(
    scenario: TensionScenario,
    control: TensionControl,
    X_WP: RigidTransform,
    time: float,
    status: SimulatorStatus | None = None,
) -> Outcome:
    stop = None if control.meters is None else control.meters.stop
    if status is not None and stop is not None and status.system() is stop:
        return Outcome.CONTACT
    p, (lower, upper) = X_WP.translation(), control.robot.frame.bounds()
    below = 0.0 if scenario.world is None else scenario.world.room_below()
    if np.any(p < lower - [0.0, 0.0, below]) or np.any(p > upper):
        return Outcome.DIVERGED
    done = time >= scenario.duration * (1.0 - 1e-12)
    return Outcome.COMPLETED if done else Outcome.RUNNING


def unfinished_tension_run(scenario: TensionScenario, log: Log) -> TensionRun:
    """A run whose program ended before it did, from its scenario and what it had logged."""
    return TensionRun(scenario=scenario, control=make_control(scenario), **left_unfinished(log))


def make_simulator(control: TensionControl, scenario: TensionScenario) -> Simulator:
    """A simulator at the start of the trajectory, with the scenario's integrator."""
    rule = scenario.integration
    return fixed_step_simulator(
        control.diagram, control.make_context(), rule.integrator, rule.max_step
    )


def geometry_words(run: TensionRun) -> str:
    """Geometry of the cables, as `Robot.geometry_words`, and of those of the distribution."""
    scenario = run.scenario
    settings = CableSettings(pulleys=scenario.cables.pulleys)
    believed = scenario.cables.pulleys and scenario.distribution.pulleys
    return settings.geometry_words(run.control.robot, believed)


def summarize_tension_run(run: TensionRun) -> dict[str, Any]:
    """The summary of a run, for `summary.json`."""
    log, scenario = run.log, run.scenario
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    tensions = log["tensions"][1:]  # the first row stands before the first control step
    summary = {
        "scenario": scenario.name,
        "kind": scenario.kind,
        "robot": run.control.robot.name,
        "geometry": geometry_words(run),
        "controller": "computed_torque" if scenario.predictive is None else "predictive",
        "method": scenario.distribution.method,
        "seed": scenario.seed,
        **run.ending(),
        "message": run.message
        or tension_control_message(
            scenario, run.outcome, tension_end_error(run), int(log["failures"][-1, 0])
        ),
        "position_error_m": spread(distance) | {"final": float(distance[-1])},
        "rotation_error_rad": spread(angle) | {"final": float(angle[-1])},
        "tension_n": {
            "min": float(np.min(tensions, initial=np.inf)),
            "max": float(np.max(tensions, initial=-np.inf)),
        },
        "tension_limits_n": list(run.control.robot.tension_limits(scenario.limits())),
        "remarks": limit_warnings(
            "distribution.limits", scenario.distribution.limits, run.control.robot
        ),
        "infeasible_steps": int(log["failures"][-1, 0]),
        "simulated": simulated_model(run.control.robot, None, scenario.damping),
        "engine": engine_of(scenario),
        "loop": run.loop,
        "integration_step_s": scenario.integration.max_step,
        "world": world_summary(scenario, run.log),
        "versions": package_versions(),
    }
    if feels_forces(log):
        summary["forces"] = force_summary(scenario.force_control, log)
    times = run.control.blocks.distributor.step_times
    if times is not None:
        summary["program_steps"] = times.as_dict()
    if run.control.remote is not None:
        summary["remote"] = run.control.remote.report()
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def tension_end_error(run: TensionRun) -> tuple[float, float]:
    """Distance [m] and angle [rad] of the last logged pose from the desired one."""
    rows = (np.asarray(run.log[name][-1:]) for name in ("X_WP", "X_WP_desired"))
    distance, angle = pose_rows_distance(*rows)
    return float(distance[-1]), float(angle[-1])


def _title(run: TensionRun, words: str) -> str:
    """What the figure shows, and below what the run was."""
    scenario = run.scenario
    remote = run.control.remote
    client = remote is not None and remote.place == DISTRIBUTOR
    method = "client" if client else scenario.distribution.method.replace("_", " ")
    how = f"{scenario.name}, tensions by the {method}, {geometry_words(run)}"
    return f"{words}\n{scenario.title}\n({how})"


def error_figure(run: TensionRun) -> Figure:
    """Distance and angle of the platform from its desired pose over time."""
    log = run.log
    distance, angle = by_pieces(pose_rows_distance, log["X_WP"], log["X_WP_desired"])
    title = _title(run, "Platform against its desired pose")
    figure, axes = new_figure(1, 2, (12.0, 5.0), title)
    draw_curve(axes[0], log["time"], distance, DISTANCE, scale=1e3)
    axes[0].set(xlabel="time [s]", ylabel="position error [mm]")
    draw_curve(axes[1], log["time"], angle, ANGLE, scale=180.0 / np.pi)
    axes[1].set(xlabel="time [s]", ylabel="rotation error [deg]")
    missed = log["feasible"][1:, 0] == 0.0
    if np.any(missed):
        for one in axes:
            shade(one, log["time"][1:], missed, "no tensions within the bounds")
            one.legend(loc="best")
    return figure


def write_tension_data(folder: Path, run: TensionRun) -> dict[str, Any]:
    """Writes log, inputs and summary of a run into an existing folder; returns the summary."""
    summary = summarize_tension_run(run)
    write_log(folder, run.log, *tension_log_names(run))
    write_run_inputs(folder, run.scenario, run.control.robot)
    write_json(folder / "summary.json", summary)
    return summary


def tension_log_names(run: TensionRun) -> LogNames:
    """Names for the log's columns."""
    cables = [cable.name for cable in run.control.robot.cables]
    return cables, (), world_columns(run.scenario.world)


def tension_pictures(run: TensionRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws figures and replay of a run, by the names of their files."""
    robot, log = run.control.robot, run.log
    cables = CableSettings(model=ELASTIC, pulleys=run.scenario.cables.pulleys)
    drawn = {
        "error": lambda: error_figure(run),
        "tensions": lambda: tension_figure(run),
        "cable_lengths": lambda: cable_figure(
            _title(run, "Lengths of the cables"), robot, log, "lengths", "cable length [m]"
        ),
        "platform_path": lambda: platform_path_figure(run),
    }
    if feels_forces(log):
        forces = _title(run, "Forces on the platform, and where it goes")
        drawn["forces"] = lambda: force_figure(forces, run.scenario.force_control, log)
    world = run.scenario.world
    if world is not None:
        words = _title(run, world_words(world))
        drawn["world"] = lambda: world_figure(words, world, log)
    pictures: Pictures = dict(figure_writers(drawn, formats))
    pictures["replay.html"] = lambda path: write_replay(
        path, robot, log, cables=cables, around=Surroundings(world), title=run.scenario.title,
        limits=robot.tension_limits(run.scenario.limits()),
    )  # fmt: skip
    return pictures


def tension_figure(run: TensionRun) -> Figure:
    """Tensions with the bounds that the distribution keeps, from the first control step on."""
    robot = run.control.robot
    controlled = {name: values[1:] for name, values in run.log.items()}
    return cable_figure(
        _title(run, "Commanded tensions of the cables"), robot, controlled, "tensions",
        "tension [N]", bounds=robot.tension_limits(run.scenario.limits()),
    )  # fmt: skip


def platform_path_figure(run: TensionRun) -> Figure:
    """Path of the platform, and the desired one: with the whole robot, and close up."""
    robot, log = run.control.robot, run.log
    paths = []
    for name, label, look in (
        ("X_WP_desired", "platform, Po, desired", DESIRED),
        ("X_WP", "platform, Po", PLATFORM),
    ):
        points = log[name][:, 4:]
        paths.append(Path3D(np.asarray(points[path_rows(points)]), label, look))
    title = _title(run, "Path of the platform P in the world frame W")
    return path_figure(title, robot, run.scenario.cable_set(robot), log, paths)
