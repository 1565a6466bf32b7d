"""Runs of one servo, or of one command, by both engines, and how far they part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.runs import RunResult, TensionRun, run_scenario, run_tension_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.models import Robot
from cdpr_drake.spatial import pose_rows_distance
from cdpr_drake.systems.diagrams import load_scenario
from cdpr_drake.systems.robots import (
    COMPILED,
    PLANT,
    CableRobot,
    CableRobotSettings,
    CompiledCableRobot,
    StepRule,
)
from cdpr_drake.systems.scenarios import TENSION_CONTROL, scenario_kind

COLUMNS = (
    "outcome_plant",
    "outcome_compiled",
    "time_plant_s",
    "time_compiled_s",
    "distance_m",
    "angle_rad",
    "final_distance_m",
    "final_angle_rad",
    "final_error_plant_m",
    "final_error_compiled_m",
    "tension_difference_n",
    "largest_tension_n",
    "slack_share",
)
"""Numbers of a pair of runs: how each ended, how far their paths and tensions part at most and at
the end, how far each ended from its goal, and the share of cables and rows that were slack."""


def run_pair(name: str, overrides: Sequence[str]) -> Array:
    """`COLUMNS` of a scenario, run once by each engine; the camera of a servo is projected."""
    tensions = scenario_kind(name) == TENSION_CONTROL
    more = [] if tensions else ["camera.kind=projected"]
    runs: list[RunResult | TensionRun] = []
    for engine in (PLANT, COMPILED):
        scenario = load_scenario(name, [*more, *overrides, f"integration.engine={engine}"])
        runs.append((run_tension_scenario if tensions else run_scenario)(scenario))
    one, other = runs
    count = min(len(run.log["time"]) for run in runs)
    distance, angle = pose_rows_distance(one.log["X_WP"][:count], other.log["X_WP"][:count])
    end = pose_rows_distance(one.log["X_WP"][-1:], other.log["X_WP"][-1:])
    difference = np.abs(one.log["tensions"][:count] - other.log["tensions"][:count])
    return np.array([
        one.outcome, other.outcome, one.sim_time, other.sim_time,
        np.max(distance), np.max(angle), end[0][0], end[1][0],
        final_error(one), final_error(other),
        np.max(difference), np.max(one.log["tensions"]), np.mean(one.log["slack"]),
    ], float)  # fmt: skip


def final_error(run: RunResult | TensionRun) -> float:
    """Distance of the last logged pose from where it should be [m]."""
    log = run.log
    if isinstance(run, TensionRun):
        distance, _ = pose_rows_distance(log["X_WP"][-1:], log["X_WP_desired"][-1:])
        return float(distance[0])
    desired = run.servo.desired_platform_pose(float(log["time"][-1]))
    return float(np.linalg.norm(desired.translation() - log["X_WP"][-1, 4:]))


def commanded_path(
    kind: type[CableRobot | CompiledCableRobot],
    robot: Robot,
    settings: CableRobotSettings,
    X_WP: RigidTransform,
    velocities: Array,
    period: float,
    *,
    rule: StepRule,
    slack: Array | None = None,
) -> tuple[Array, Array, Array]:
    """A robot that is held at a pose and then gets a velocity of each cable for each period.

    Args:
        kind: `CableRobot`, which Drake's integrator of the rule's name moves, or
            `CompiledCableRobot`.
        robot: The robot.
        settings: Its cables; winches are ideal.
        X_WP: Where it is held [m].
        velocities: Cable velocities, shape (k, m) [m/s].
        period: For how long each is commanded [s].
        rule: How it is integrated.
        slack: Lengths paid out at the start, shape (m,) [m].

    Returns:
        State of the platform after each period, shape (k, 13 or 6), unstrained lengths then, shape
        (k, m) [m], and tensions, shape (k, m) [N].
    """
    block = kind(robot, settings)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.hang(context, X_WP, slack)
    if isinstance(block, CompiledCableRobot):
        block.integrate_by(rule)
    else:
        ResetIntegratorFromFlags(simulator, rule.method, rule.max_step).set_fixed_step_mode(True)
    port = block.GetInputPort("cable_velocities")
    ports = [
        block.GetOutputPort(name) for name in ("platform_state", "unstrained_lengths", "tensions")
    ]
    rows: list[list[Array]] = []
    for number, velocity in enumerate(velocities, 1):
        port.FixValue(context, velocity)
        simulator.AdvanceTo(number * period)
        rows.append([port.Eval(context).copy() for port in ports])
    states, lengths, tensions = (np.array([row[k] for row in rows]) for k in range(3))
    return states, lengths, tensions


def state_distance(one: Array, other: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between platforms' states, shape (k, 13 or 6)."""
    if one.shape[1] == 6:
        return (
            np.linalg.norm(one[:, :2] - other[:, :2], axis=1),
            np.abs(one[:, 2] - other[:, 2]),
        )
    rows = [np.hstack([_unit(states[:, :4]), states[:, 4:7]]) for states in (one, other)]
    return pose_rows_distance(*rows)


def _unit(quaternions: Array) -> Array:
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=1)[:, None], float)
