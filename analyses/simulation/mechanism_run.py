"""Runs a scenario of a mechanism on its cables, and tells what it did."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.frame.thinning import by_pieces
from cdpr_drake.analyses.reporting.log_files import (
    LogNames,
    finite,
    spread,
    write_json,
    write_log,
    write_scenario,
)
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.reporting.provenance import package_versions, write_mechanism
from cdpr_drake.analyses.simulation.run_loop import (
    LONGEST_WARM_UP,
    EndedRun,
    advance,
    ended,
    fixed_step_simulator,
    left_unfinished,
)
from cdpr_drake.analyses.simulation.session import DEFAULT_SESSION, RunSession, check_connected
from cdpr_drake.analyses.simulation.start_checks import check_length, limit_warnings
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.systems.diagrams.mechanism_control import (
    MechanismFollower,
    build_mechanism_follower,
)
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.mechanism_scenario import COMPUTED_TORQUE, MechanismScenario

METHOD = "runge_kutta3"
"""Of both engines."""

STABLE = 1.7
"""Largest circular frequency, times the step, that runge_kutta3 follows without growing: sqrt(3) on
the imaginary axis. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.2."""


@dataclass(frozen=True, kw_only=True)
class MechanismRun(EndedRun):
    """What a run did; its outcome is COMPLETED, DIVERGED or INTERRUPTED.

    Attributes:
        scenario: The scenario.
        follower: The diagram and its handles.
    """

    scenario: MechanismScenario
    follower: MechanismFollower


def check_mechanism_run(scenario: MechanismScenario) -> list[str]:
    """Builds a scenario and throws it away; what speaks against it."""
    step = scenario.integration.max_step
    check_length(scenario.name, scenario.duration, step)
    follower = build_mechanism_follower(scenario)
    follower.make_context()
    limits = limit_warnings("control.limits", scenario.control.limits, follower.mechanism)
    warnings = [f"{scenario.name}: {words}" for words in limits]
    if follower.motion.end_time > scenario.duration:
        warnings.append(
            f"{scenario.name}: duration: found {scenario.duration:g} s; the last of "
            f"motion.waypoints is at {follower.motion.end_time:g} s"
        )
    if follower.rest is None:
        return warnings
    warnings += [f"{scenario.name}: at the start, {note}" for note in follower.rest.notes]
    if follower.rest.stability == "unstable":
        warnings.append(f"{scenario.name}: at the start it is {follower.rest.stability}")
    squared = follower.rest.squared_frequencies
    fastest = float(np.sqrt(max(np.max(squared, initial=0.0), 0.0)))
    if fastest * step > STABLE:
        warnings.append(
            f"{scenario.name}: integration.max_step: found {step:g} s, at which vibrations on the "
            f"cables grow; accepted: at most {STABLE / fastest:.2g} s"
        )
    return warnings


def run_mechanism_scenario(
    scenario: MechanismScenario, session: RunSession = DEFAULT_SESSION, **how: Any
) -> MechanismRun:
    """Simulates a scenario to the end of its duration; arguments as `run_scenario`.

    The run has diverged when a cable cannot run or the state is not finite.
    """
    session = session.having(how)
    check_connected(scenario, session.connect)
    follower = build_mechanism_follower(scenario)
    # Loads compiled kernels. Where it diverges, the run will, and keeps what it has logged.
    with suppress(CableGeometryError, RuntimeError):
        warm = _simulator(follower)
        warm.AdvanceTo(min(2.0 / scenario.control.rate, scenario.duration, LONGEST_WARM_UP))
    simulator = _simulator(follower)
    session.begin(simulator, follower.diagram)
    context = simulator.get_mutable_context()
    keeper = session.keeper(follower.log, context, follower.read_log, scenario)
    done = scenario.duration * (1.0 - 1e-12)
    end = advance(
        simulator,
        scenario.duration,
        lambda _: Outcome.COMPLETED if context.get_time() >= done else Outcome.RUNNING,
        lambda: follower.errors(context),
        session,
        keeper,
    )
    return MechanismRun(
        **ended(end, keeper, context.get_time()), scenario=scenario, follower=follower
    )


def unfinished_mechanism_run(scenario: MechanismScenario, log: Log) -> MechanismRun:
    """A run whose program ended before it did, from its scenario and what it had logged."""
    follower = build_mechanism_follower(scenario)
    return MechanismRun(scenario=scenario, follower=follower, **left_unfinished(log))


def _simulator(follower: MechanismFollower) -> Simulator:
    step = follower.scenario.integration.max_step
    return fixed_step_simulator(follower.diagram, follower.make_context(), METHOD, step)


def first_commanded(run: MechanismRun) -> int:
    """First row of the log with tensions that were asked for: by computed torque the first one
    stands before the first control step."""
    return 1 if run.scenario.control.kind == COMPUTED_TORQUE else 0


def largest_errors(run: MechanismRun) -> tuple[Array, Array]:
    """Largest distance [m] and angle [rad] of a joint or free body in each row, shape (n,)."""

    def largest(rows: Array) -> tuple[Array, Array]:
        errors = list(run.follower.part_errors(rows).values())
        return np.max([e[0] for e in errors], axis=0), np.max([e[1] for e in errors], axis=0)

    distance, angle = by_pieces(largest, run.log["way_off"])
    return distance, angle


def mechanism_end_error(run: MechanismRun) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] of a joint or free body in the last row."""
    errors = run.follower.part_errors(np.asarray(run.log["way_off"][-1])).values()
    return float(max(e[0] for e in errors)), float(max(e[1] for e in errors))


def mechanism_geometry(run: MechanismRun) -> str:
    """Geometry of the cables in words, as `CableSet.geometry_words`."""
    plant = MultibodyPlant(0.0)
    added = add_mechanism(plant, run.follower.mechanism)
    added.finalize()
    return added.routes().ends.geometry_words(run.scenario.cables.pulleys)


def summarize_mechanism_run(run: MechanismRun) -> dict[str, Any]:
    """The summary of a run, for `summary.json`."""
    scenario, follower, log = run.scenario, run.follower, run.log
    control, (low, high) = scenario.control, follower.limits
    distance, angle = largest_errors(run)
    first = first_commanded(run)
    tensions, slack = log["tensions"][first:], log["slack"][first:]
    time, parts = np.asarray(log["time"]), follower.part_errors(np.asarray(log["way_off"]))
    names, rest = follower.velocity_names(), follower.rest
    summary = {
        "scenario": scenario.name,
        "kind": scenario.kind,
        "mechanism": follower.mechanism.name,
        "geometry": mechanism_geometry(run),
        "control": control.kind,
        "method": control.method if rest is None else None,
        **run.ending(),
        "position_error_m": spread(distance) | {"final": float(distance[-1])},
        "rotation_error_rad": spread(angle) | {"final": float(angle[-1])},
        "parts": {name: _part(*errors) for name, errors in parts.items()},
        "tension_n": {
            "min": float(np.min(tensions, initial=np.inf)),
            "max": float(np.max(tensions, initial=-np.inf)),
        },
        "tension_limits_n": [low, high],
        "remarks": limit_warnings("control.limits", control.limits, follower.mechanism),
        "beyond_limits_n": float(
            max(np.max(tensions - high, initial=0.0), np.max(low - tensions, initial=0.0))
        ),
        "slack_cable_seconds": float(np.sum(np.diff(time[first:])[:, None] * (slack[:-1] > 0.0))),
        "infeasible_steps": int(log["failures"][-1, 0]) if "failures" in log else None,
        "motor_force_n_nm": {
            names[row]: float(np.max(np.abs(log["motor_forces"][:, k]), initial=0.0))
            for k, row in enumerate(follower.motors())
        },
        "start": None if rest is None else {
            "stability": rest.stability,
            "tensions_n": rest.tensions.tolist(),
            "unstrained_lengths_m": rest.unstrained_lengths.tolist(),
        },
        "engine": scenario.integration.engine,
        "loop": "diagram",
        "integration_step_s": scenario.integration.max_step,
        "versions": package_versions(),
    }  # fmt: skip
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def _part(distance: Array, angle: Array) -> dict[str, dict[str, float]]:
    """Errors of one joint or free body."""
    return {
        "distance_m": {"max": float(np.max(distance)), "final": float(distance[-1])},
        "angle_rad": {"max": float(np.max(angle)), "final": float(angle[-1])},
    }


def mechanism_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and words for the table at the end."""
    position, rotation = summary["position_error_m"], summary["rotation_error_rad"]
    tension, (low, high) = summary["tension_n"], summary["tension_limits_n"]

    def error(key: str) -> str:
        if position[key] is None or rotation[key] is None:
            return "not known"
        return f"{1e3 * position[key]:.4f} mm, {np.degrees(rotation[key]):.5f} deg"

    how = "on winches" if summary["method"] is None else f"by {summary['method']}"
    words = "none" if tension["min"] is None else f"{tension['min']:.2f} to {tension['max']:.2f} N"
    facts = [
        ("largest error", error("max")),
        ("final error", error("final")),
        ("tensions", f"{words} {how}; limits {low:g} to {high:g} N"),
    ]
    if summary["slack_cable_seconds"]:
        facts.append(("slack", f"{summary['slack_cable_seconds']:.2f} cable seconds"))
    if summary["infeasible_steps"] is not None:
        facts.append(("infeasible steps", str(summary["infeasible_steps"])))
    forces = summary["motor_force_n_nm"]
    if forces:
        name = max(forces, key=lambda key: forces[key] or 0.0)
        facts.append(
            ("motors", f"{len(forces)}; at most {forces[name] or 0.0:.1f} N or N m, {name}")
        )
    return facts


def write_mechanism_inputs(folder: Path, scenario: MechanismScenario) -> None:
    """Writes mechanism and scenario as they are run, overrides included, into a folder.

    The scenario names the mechanism's file beside it, which names the files of bodies and joints
    where they are.
    """
    written = write_mechanism(folder, scenario.mechanism)
    write_scenario(folder / "scenario.yaml", replace(scenario, mechanism=written))


def write_mechanism_data(folder: Path, run: MechanismRun) -> dict[str, Any]:
    """Writes log, inputs and summary of a run into an existing folder; returns the summary."""
    summary = summarize_mechanism_run(run)
    write_log(folder, run.log, *mechanism_log_names(run))
    write_mechanism_inputs(folder, run.scenario)
    write_json(folder / "summary.json", summary)
    return summary


def mechanism_log_names(run: MechanismRun) -> LogNames:
    """Names for the log's columns."""
    follower = run.follower
    positions, names = follower.position_names(), follower.velocity_names()
    parts = {
        "positions": positions,
        "wanted_positions": positions,
        "velocities": [f"{name}_s" for name in _with_units(follower)],
        "wanted_velocities": [f"{name}_s" for name in _with_units(follower)],
        "way_off": _with_units(follower),
        "motor_forces": [
            f"{names[row]}_{'nm' if follower.turns()[row] else 'n'}" for row in follower.motors()
        ],
    }
    return list(follower.cables.routes.names), (), parts


def _with_units(follower: MechanismFollower) -> list[str]:
    pairs = zip(follower.velocity_names(), follower.turns(), strict=True)
    return [f"{name}_{'rad' if turns else 'm'}" for name, turns in pairs]
