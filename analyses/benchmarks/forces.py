"""Benchmarks of forces: laws that answer them, estimates of wrenches, and the look for a break."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    processor_seconds,
)
from cdpr_drake.analyses.simulation.tension_control_run import make_control, make_simulator
from cdpr_drake.estimation.break_detection import BreakRule, fresh_memory
from cdpr_drake.estimation.break_detection_kernel import break_step
from cdpr_drake.estimation.wrench_observers import OBSERVERS, WrenchObserver, packed_body
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths, motion_of
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario

SCENARIO = "acrobot_against_wind"

LAWS = {
    "impedance": (
        "force_control={kind: impedance, stiffness: [20, 20, 20, 400, 400, 400], "
        "damping: [1, 1, 1, 60, 60, 60]}"
    ),
    "admittance": (
        "force_control={kind: admittance, mass: [0.1, 0.1, 0.1, 4, 4, 4], "
        "damping: [1, 1, 1, 60, 60, 60], stiffness: [5, 5, 5, 0, 0, 0], reject: true}"
    ),
    "hybrid": (
        "force_control={kind: hybrid, axes: [z], force: [0, 0, -5], contact_stiffness: 30000}"
    ),
    "disturbance observer": "force_control={kind: tracking, reject: true}",
}
"""Laws by their sections; computed torque alone is what they are held against."""


def _advancer(change: str) -> Callable[[float], None]:
    """What advances the scenario by a time [s]."""
    scenario = load_scenario(SCENARIO, [change, "disturbances=null"])
    assert isinstance(scenario, TensionScenario)
    simulator = make_simulator(make_control(scenario), scenario)
    simulator.Initialize()
    context = simulator.get_context()
    return lambda time: simulator.AdvanceTo(context.get_time() + time) and None


def force_rows(quick: bool) -> list[TimingRow]:
    """Each law at 1 kHz through the diagram against computed torque; observers, looks for a break.

    All by processor time of this process, since each row is work of one thread.
    """
    repeats, duration = (3, 0.1) if quick else (9, 0.5)
    ways = [_advancer("force_control=null"), *map(_advancer, LAWS.values())]
    torque, *times = interleaved(
        [
            lambda advance=advance: (  # type: ignore[misc]
                processor_seconds(lambda: advance(duration)) / duration
            )
            for advance in ways
        ],
        repeats,
    )
    rows = [
        TimingRow(
            f"law of forces, 1 kHz, {name}", 1e3 * time, "ms/simulated s", "computed torque",
            1e3 * torque, time / torque, ratio_means="of the time with computed torque",
        )
        for name, time in zip(LAWS, times, strict=True)
    ]  # fmt: skip
    calls = 200 if quick else 2000
    return rows + observer_rows(repeats, calls) + break_rows(repeats, calls)


def observer_rows(repeats: int, calls: int) -> list[TimingRow]:
    """A sample of each observer against the Jacobian of eight cables over pulleys, both called from
    Python."""
    robot = load_robot("acrobot_large")
    cables, X_WP = robot.cable_set(), robot.home.transform()
    body = packed_body(3.5, np.zeros(3), np.eye(3), np.array([0.0, 0.0, -9.81]))
    wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 30.0])

    def sampler(kind: str) -> Callable[[], object]:
        observer = WrenchObserver(kind, body, 40.0, 1e-3)
        return lambda: observer.update(X_WP, wrench)

    ways: list[Callable[[], object]] = [lambda: cable_jacobian(RigidTransform(X_WP), cables)]
    ways += [sampler(kind) for kind in OBSERVERS]
    jacobian, *times = interleaved(
        [lambda way=way: processor_seconds(way, calls) for way in ways],  # type: ignore[misc]
        repeats,
    )
    return [
        TimingRow(
            f"wrench observer, {kind}", 1e6 * time, "us/sample", "Jacobian, 8 cables over pulleys",
            1e6 * jacobian, jacobian / time, ratio_means="samples in the time of one Jacobian",
        )
        for kind, time in zip(OBSERVERS, times, strict=True)
    ]  # fmt: skip


def break_rows(repeats: int, calls: int) -> list[TimingRow]:
    """A look for a broken cable among eight against a sample of the momentum observer."""
    robot = load_robot("acrobot_large")
    cables, X_WP = robot.cable_set(), robot.home.transform()
    motion, rows, m = motion_of(X_WP), cables.packed(), cables.count
    lengths, tensions, silent = cable_paths(X_WP, cables).lengths, np.full(m, 5.0), np.full(m, 0.3)
    rule, memory = BreakRule(1e-3, 4e-3, 3e-3, 3).packed(), fresh_memory(m)
    body = packed_body(3.5, np.zeros(3), np.eye(3), np.array([0.0, 0.0, -9.81]))
    wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 30.0])
    observer = WrenchObserver("momentum", body, 40.0, 1e-3)
    look, sample = interleaved(
        [
            lambda: processor_seconds(
                lambda: break_step(motion, rows, lengths, tensions, silent, rule, memory), calls
            ),
            lambda: processor_seconds(lambda: observer.update(X_WP, wrench), calls),
        ],
        repeats,
    )
    return [
        TimingRow(
            "look for a broken cable", 1e6 * look, "us/look", "sample of the momentum observer",
            1e6 * sample, sample / look, ratio_means="looks in the time of one sample",
        )
    ]  # fmt: skip
