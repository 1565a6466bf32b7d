"""Runs a scenario of dynamic control by tensions, and writes what it did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus

from cdpr_drake.analyses.pictures import (
    Path3D,
    cable_figure,
    figure_writer,
    new_figure,
    path_figure,
    write_replay,
)
from cdpr_drake.analyses.reporting import (
    Pictures,
    finite,
    package_versions,
    spread,
    write_json,
    write_log,
    write_scenario,
)
from cdpr_drake.analyses.runs.loop import Progress, advance
from cdpr_drake.arrays import Array
from cdpr_drake.models import load_robot
from cdpr_drake.spatial import pose_rows_distance
from cdpr_drake.systems.diagrams import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.monitoring import Outcome
from cdpr_drake.systems.robots import CableSettings
from cdpr_drake.systems.scenarios import TensionScenario


@dataclass(frozen=True, kw_only=True)
class TensionRun:
    """What a run did.

    Attributes:
        scenario: The scenario.
        control: The diagram and its handles.
        log: Times "time", shape (n,) [s], and the exported quantities, shape (n, size).
        outcome: COMPLETED, DIVERGED or INTERRUPTED.
        message: Why, where there is more to say; else empty.
        sim_time: Simulated time [s].
        wall_time: Time that the simulation took [s].
    """

    scenario: TensionScenario
    control: TensionControl
    log: dict[str, Array]
    outcome: Outcome
    message: str
    sim_time: float
    wall_time: float


def make_control(scenario: TensionScenario) -> TensionControl:
    """The diagram of a scenario, with its log; raises what `build_tension_control` does."""
    robot = load_robot(scenario.robot)
    return build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=scenario.trajectory.trajectory(),
            gains=scenario.controller.gains(),
            method=scenario.distribution.method,
            limits=scenario.limits(),
            rate=scenario.controller.rate,
            reference=scenario.reference_tensions(robot),
            cables=scenario.cable_set(robot),
            believed_cables=scenario.believed_cables(robot),
        ),
        log_rate=scenario.log_rate,
    )


def run_tension_scenario(
    scenario: TensionScenario,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> TensionRun:
    """Simulates a scenario to the end of its duration; arguments as `run_scenario`.

    The run has diverged when the platform leaves the frame or its state is not finite.
    """
    control = make_control(scenario)
    warm = make_simulator(control, scenario)
    warm.AdvanceTo(min(2.0 / scenario.controller.rate, scenario.duration))
    simulator = make_simulator(control, scenario)
    context = simulator.get_context()
    frame, plant = control.robot.frame, control.in_plant.plant

    def outcome_after(status: SimulatorStatus) -> Outcome:
        p = control.in_plant.pose(plant.GetMyContextFromRoot(context)).translation()
        if np.any(p < frame.lower) or np.any(p > frame.upper):
            return Outcome.DIVERGED
        done = context.get_time() >= scenario.duration * (1.0 - 1e-12)
        return Outcome.COMPLETED if done else Outcome.RUNNING

    end = advance(
        simulator,
        scenario.duration,
        outcome_after,
        lambda: control.errors(context),
        on_progress,
        should_stop,
    )
    log = control.read_log(context)
    return TensionRun(
        scenario=scenario,
        control=control,
        log=log,
        outcome=end.outcome,
        message=end.message,
        sim_time=context.get_time(),
        wall_time=end.wall_time,
    )


def make_simulator(control: TensionControl, scenario: TensionScenario) -> Simulator:
    """A simulator at the start of the trajectory, with the scenario's integrator."""
    simulator = Simulator(control.diagram, control.make_context())
    integration = scenario.integration
    ResetIntegratorFromFlags(
        simulator, integration.integrator, integration.max_step
    ).set_fixed_step_mode(True)
    return simulator


def summarize_tension_run(run: TensionRun) -> dict[str, Any]:
    """The summary of a run, for `summary.json`."""
    log, scenario = run.log, run.scenario
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    tensions = log["tensions"][1:]  # the first row stands before the first control step
    summary = {
        "scenario": scenario.name,
        "kind": scenario.kind,
        "robot": run.control.robot.name,
        "controller": "computed_torque",
        "method": scenario.distribution.method,
        "seed": scenario.seed,
        "outcome": run.outcome.name.lower(),
        "message": run.message,
        "sim_time_s": run.sim_time,
        "wall_time_s": run.wall_time,
        "realtime_factor": run.sim_time / run.wall_time if run.wall_time > 0.0 else None,
        "position_error_m": spread(distance) | {"final": float(distance[-1])},
        "rotation_error_rad": spread(angle) | {"final": float(angle[-1])},
        "tension_n": {
            "min": float(np.min(tensions, initial=np.inf)),
            "max": float(np.max(tensions, initial=-np.inf)),
        },
        "infeasible_steps": int(log["failures"][-1, 0]),
        "integration_step_s": scenario.integration.max_step,
        "versions": package_versions(),
    }
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def _title(run: TensionRun) -> str:
    return f"{run.scenario.name}, {run.scenario.distribution.method}"


def error_figure(run: TensionRun) -> Figure:
    """Distance and angle of the platform from its desired pose over time."""
    log = run.log
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
    figure, axes = new_figure(1, 2, (12.0, 4.5), _title(run))
    axes[0].plot(log["time"], 1e3 * distance, label="distance")
    axes[0].set(xlabel="time [s]", ylabel="position error [mm]")
    axes[1].plot(log["time"], np.degrees(angle), label="angle")
    axes[1].set(xlabel="time [s]", ylabel="rotation error [deg]")
    missed = log["feasible"][1:, 0] == 0.0
    for one in axes:
        if np.any(missed):
            times = log["time"][1:]
            low, high = one.get_ylim()
            one.fill_between(
                times, low, high, where=missed.tolist(), color="C3", alpha=0.15, label="infeasible"
            )
        one.legend(loc="best")
    return figure


def write_tension_data(folder: Path, run: TensionRun) -> dict[str, Any]:
    """Writes log, scenario and summary of a run into an existing folder; returns the summary."""
    summary = summarize_tension_run(run)
    write_log(folder, run.log, [cable.name for cable in run.control.robot.cables])
    write_scenario(folder / "scenario.yaml", run.scenario)
    write_json(folder / "summary.json", summary)
    return summary


def tension_pictures(run: TensionRun) -> Pictures:
    """What draws figures and replay of a run, by the names of their files."""
    robot, log, title = run.control.robot, run.log, _title(run)
    controlled = {name: values[1:] for name, values in log.items()}
    paths = [
        Path3D(log["X_WP_desired"][:, 4:], "desired", "C2", "-"),
        Path3D(log["X_WP"][:, 4:], "platform", "C0", ":"),
    ]
    real = run.scenario.cable_set(robot)
    cables = CableSettings(pulleys=run.scenario.cables.pulleys)
    figures = {
        "error": lambda: error_figure(run),
        "tensions": lambda: cable_figure(title, robot, controlled, "tensions", "tension [N]"),
        "cable_lengths": lambda: cable_figure(title, robot, log, "lengths", "cable length [m]"),
        "platform_path": lambda: path_figure(title, robot, real, log, paths),
    }
    pictures: Pictures = {f"{name}.png": figure_writer(draw) for name, draw in figures.items()}
    pictures["replay.html"] = lambda path: write_replay(path, robot, log, cables=cables)
    return pictures
