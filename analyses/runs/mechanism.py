"""Runs of mechanisms on cables: how one steps, its numbers and its figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import QuaternionFloatingJoint

from cdpr_drake.analyses.frame.figures import curves, draw_curve, new_figure, panels, shade, styled
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.thinning import by_pieces
from cdpr_drake.analyses.reporting.log_files import write_scenario
from cdpr_drake.analyses.reporting.provenance import (
    code_version,
    mechanism_arguments,
    write_mechanism,
)
from cdpr_drake.analyses.runs.checks import check_length, limit_warnings
from cdpr_drake.analyses.runs.engine import DiagramEngine
from cdpr_drake.analyses.runs.log import spread
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.mechanism_replay import write_mechanism_replay
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.palette import Look
from cdpr_drake.schema.typed_yaml import plain_values
from cdpr_drake.systems.diagrams.mechanism_control import (
    MechanismFollower,
    build_mechanism_follower,
    part_name,
)
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import MECHANISM
from cdpr_drake.systems.scenarios.mechanism_motion import moving_joints
from cdpr_drake.systems.scenarios.mechanism_scenario import COMPUTED_TORQUE

METHOD = "runge_kutta3"
"""Integrator of both engines."""

STABLE = 1.7
"""Largest circular frequency, times the step, that runge_kutta3 follows without growing: sqrt(3) on
the imaginary axis. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.2."""

COLUMNS, MOST_PANELS = 3, 24
"""Panels side by side, and largest number of panels, of a figure of positions."""

DESIRED = Look("#b8b8b8")
"""Wide and pale, as the reached positions are drawn over it."""


class MechanismRun(Run):
    """A run of a mechanism; its outcome is COMPLETED, DIVERGED or INTERRUPTED."""

    kind = MECHANISM

    @cached_property
    def built(self) -> MechanismFollower:
        """The diagram and its handles."""
        return build_mechanism_follower(self.scenario)

    @cached_property
    def robot(self) -> Any:
        """The mechanism."""
        return self.built.mechanism

    @cached_property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `CableSet.geometry_words`."""
        added = add_mechanism(MultibodyPlant(0.0), self.robot)
        added.finalize()
        return added.routes().ends.geometry_words(self.scenario.cables.pulleys)

    def check(self) -> list[str]:
        name, step = self.scenario.name, self.scenario.integration.max_step
        check_length(self.scenario, step)
        self.built.make_context()
        rest = self.built.rest
        warnings = [f"{name}: {words}" for words in self._limit_warnings()]
        if self.built.motion.end_time > self.scenario.duration:
            warnings.append(
                f"{name}: duration: found {self.scenario.duration:g} s; the last of "
                f"motion.waypoints is at {self.built.motion.end_time:g} s"
            )
        if rest is None:
            return warnings
        warnings += [f"{name}: at the start, {note}" for note in rest.notes]
        if rest.stability == "unstable":
            warnings.append(f"{name}: at the start it is {rest.stability}")
        fastest = float(np.sqrt(max(np.max(rest.squared_frequencies, initial=0.0), 0.0)))
        if fastest * step > STABLE:
            warnings.append(
                f"{name}: integration.max_step: found {step:g} s, at which vibrations on the "
                f"cables grow; accepted: at most {STABLE / fastest:.2g} s"
            )
        return warnings

    def _limit_warnings(self) -> list[str]:
        return limit_warnings("control.limits", self.scenario.control.limits, self.robot)

    def engine(self, follow: Follow, resume: bool) -> DiagramEngine:
        duration, step = self.scenario.duration, self.scenario.integration.max_step

        def outcome(context: Any, _: Any) -> Outcome:
            over = context.get_time() >= duration * (1.0 - 1e-12)
            return Outcome.COMPLETED if over else Outcome.RUNNING

        warm_up = 2.0 / self.scenario.control.rate
        return DiagramEngine(
            self.built, METHOD, step, duration, warm_up, outcome, self.built.errors
        )

    def arguments(self) -> dict[str, Any]:
        settings = plain_values(self.scenario)
        moved = mechanism_arguments(settings.pop("mechanism"))
        return {"cdpr_drake": code_version(), "scenario": settings, **moved}

    def write_inputs(self, folder: Path) -> None:
        written = write_mechanism(folder, self.scenario.mechanism)
        write_scenario(folder / "scenario.yaml", replace(self.scenario, mechanism=written))

    def log_names(self) -> dict[str, Sequence[str]]:
        built = self.built
        positions, names, turns = built.position_names(), built.velocity_names(), built.turns()
        units = [
            f"{name}_{'rad' if turn else 'm'}" for name, turn in zip(names, turns, strict=True)
        ]
        rates = [f"{name}_s" for name in units]
        return {
            "cables": list(built.cables.routes.names), "positions": positions,
            "wanted_positions": positions, "velocities": rates, "wanted_velocities": rates,
            "way_off": units,
            "motor_forces": [f"{names[k]}_{'nm' if turns[k] else 'n'}" for k in built.motors()],
        }  # fmt: skip

    @property
    def first(self) -> int:
        """First row with commanded tensions; with computed torque row 0 is before the first step
        of control."""
        return 1 if self.scenario.control.kind == COMPUTED_TORQUE else 0

    def end_error(self) -> tuple[float, float]:
        errors = self.built.part_errors(np.asarray(self.log["way_off"][-1])).values()
        return float(max(e[0] for e in errors)), float(max(e[1] for e in errors))

    def numbers(self) -> dict[str, Any]:
        scenario, built, log, first = self.scenario, self.built, self.log, self.first
        control, (low, high), rest = scenario.control, built.limits, built.rest
        parts = built.part_errors(np.asarray(log["way_off"]))
        distance, angle = (np.max([e[k] for e in parts.values()], axis=0) for k in (0, 1))
        tensions, slack, time = log["tensions"][first:], log["slack"][first:], log["time"][first:]
        names = built.velocity_names()
        return {
            "scenario": scenario.name,
            "kind": scenario.kind,
            "mechanism": built.mechanism.name,
            "geometry": self.geometry,
            "control": control.kind,
            "method": control.method if rest is None else None,
            **self.ending(),
            "position_error_m": spread(distance) | {"final": float(distance[-1])},
            "rotation_error_rad": spread(angle) | {"final": float(angle[-1])},
            "parts": {
                name: {
                    key: {"max": float(np.max(values)), "final": float(values[-1])}
                    for key, values in zip(("distance_m", "angle_rad"), errors, strict=True)
                }
                for name, errors in parts.items()
            },
            "tension_n": {
                "min": float(np.min(tensions, initial=np.inf)),
                "max": float(np.max(tensions, initial=-np.inf)),
            },
            "tension_limits_n": [low, high],
            "remarks": self._limit_warnings(),
            "beyond_limits_n": float(
                max(np.max(tensions - high, initial=0.0), np.max(low - tensions, initial=0.0))
            ),
            "slack_cable_seconds": float(np.sum(np.diff(time)[:, None] * (slack[:-1] > 0.0))),
            "infeasible_steps": int(log["failures"][-1, 0]) if "failures" in log else None,
            "motor_force_n_nm": {
                names[row]: float(np.max(np.abs(log["motor_forces"][:, k]), initial=0.0))
                for k, row in enumerate(built.motors())
            },
            "start": None if rest is None else {
                "stability": rest.stability,
                "tensions_n": rest.tensions.tolist(),
                "unstrained_lengths_m": rest.unstrained_lengths.tolist(),
            },
            "engine": scenario.integration.engine,
            "loop": "diagram",
            "integration_step_s": scenario.integration.max_step,
            "versions": self.versions(),
        }  # fmt: skip

    def facts(self, summary: Mapping[str, Any]) -> list[tuple[str, str]]:
        position, rotation = summary["position_error_m"], summary["rotation_error_rad"]
        tension, (low, high) = summary["tension_n"], summary["tension_limits_n"]

        def error(key: str) -> str:
            if position[key] is None or rotation[key] is None:
                return "not known"
            return f"{1e3 * position[key]:.4f} mm, {np.degrees(rotation[key]):.5f} deg"

        method = "on winches" if summary["method"] is None else f"by {summary['method']}"
        span = "none"
        if tension["min"] is not None:
            span = f"{tension['min']:.2f} to {tension['max']:.2f} N"
        facts = [
            ("largest error", error("max")), ("final error", error("final")),
            ("tensions", f"{span} {method}; limits {low:g} to {high:g} N"),
        ]  # fmt: skip
        if summary["slack_cable_seconds"]:
            facts.append(("slack", f"{summary['slack_cable_seconds']:.2f} cable seconds"))
        if summary["infeasible_steps"] is not None:
            facts.append(("infeasible steps", str(summary["infeasible_steps"])))
        if forces := summary["motor_force_n_nm"]:
            name = max(forces, key=lambda key: forces[key] or 0.0)
            most = f"at most {forces[name] or 0.0:.1f} N or N m, {name}"
            facts.append(("motors", f"{len(forces)}; {most}"))
        return facts

    def subtitle(self) -> str:
        control, words = self.scenario.control, "on winches"
        if control.kind == COMPUTED_TORQUE:
            words = f"computed torque, tensions by the {control.method.replace('_', ' ')}"
        return f"{self.geometry}, {words}"

    def main_figures(self) -> dict[str, Callable[[], Figure]]:
        drawn: dict[str, Callable[[], Figure]] = {
            "error": partial(error_figure, self),
            "positions": partial(position_figure, self),
            "tensions": partial(self.cable_figure, "Tensions", "tensions", "tension [N]"),
            "cable_lengths": partial(self.cable_figure, "Lengths", "lengths", "cable length [m]"),
        }
        if len(self.built.motors()):
            drawn["motor_forces"] = partial(motor_figure, self)
        return drawn

    def cable_figure(self, words: str, quantity: str, label: str) -> Figure:
        """A quantity of the cables over time, tensions with their limits."""
        bounds, first = None, 0
        if quantity == "tensions":
            bounds, first = self.built.limits, self.first
        log = {name: self.log[name][first:] for name in ("time", "slack", quantity)}
        title = self.title(f"{words} of the cables")
        return cable_figure(title, self.robot, log, quantity, label, bounds=bounds)

    def replay(self, path: Path) -> None:
        limits = self.built.limits
        write_mechanism_replay(path, self.robot, self.log, limits=limits, title=self.heading)


@dataclass(frozen=True)
class _Panel:
    """Some coordinates of a joint or free body; `values` computes them of all positions."""

    name: str
    label: str
    curves: tuple[str, ...]
    values: Callable[[Array], Array]


def _panels(run: MechanismRun) -> Iterator[_Panel]:
    """Panels of all joints and free bodies."""
    for joint in moving_joints(run.built.plant):
        name, start = part_name(run.built.plant, joint), joint.position_start()
        if isinstance(joint, QuaternionFloatingJoint):
            place = partial(_scaled, range(start + 4, start + 7), 1.0)
            yield _Panel(name, "origin [m]", ("x", "y", "z"), place)
            yield _Panel(name, "angles [deg]", ("phi", "theta", "psi"), partial(_angles, start))
            continue
        turns = [joint.position_suffix(k).startswith("q") for k in range(joint.num_positions())]
        for turning, label, scale in (
            (True, "angle [deg]", np.degrees(1.0)), (False, "position [m]", 1.0),
        ):  # fmt: skip
            columns = [start + k for k, turn in enumerate(turns) if turn == turning]
            if columns:
                suffixes = tuple(joint.position_suffix(c - start) for c in columns)
                names = suffixes if len(columns) > 1 else ("",)
                yield _Panel(name, label, names, partial(_scaled, columns, scale))


def _scaled(columns: Sequence[int], scale: float, q: Array) -> Array:
    return scale * np.asarray(q)[:, list(columns)]


def _angles(start: int, q: Array) -> Array:
    """Angles phi, theta, psi of a quaternion [deg]."""
    wxyz = np.asarray(q)[:, start : start + 4]
    R = (RotationMatrix(Quaternion(row / np.linalg.norm(row))) for row in wxyz)
    return np.degrees([angles_from_rotation(each) for each in R])


def position_figure(run: MechanismRun) -> Figure:
    """Positions of joints and free bodies, desired and reached."""
    every, log, time = list(_panels(run)), run.log, run.log["time"]
    shown = every[:MOST_PANELS]
    rows, columns = -(-len(shown) // COLUMNS), min(COLUMNS, len(shown))
    words = "Positions of joints and free bodies"
    if len(shown) < len(every):
        words += f": the first {len(shown)} of {len(every)}"
    size = (4.6 * columns + 1.0, 2.7 * rows + 1.4)
    figure, all_axes = panels(len(shown), COLUMNS, size, run.title(words), share_x=True)
    with styled():
        for axes, panel in zip(all_axes, shown, strict=True):
            goal = by_pieces(panel.values, log["wanted_positions"])
            for k in range(len(panel.curves)):
                label = "wanted" if k == len(panel.curves) - 1 else None
                draw_curve(axes, time, goal[:, k], DESIRED, label, linewidth=6.0)
            reached = by_pieces(panel.values, log["positions"])
            curves(axes, time, reached, [f"{name} reached".strip() for name in panel.curves])
            axes.set_title(panel.name, fontsize=11)
            axes.set_ylabel(panel.label)
            axes.margins(x=0.01)
            axes.legend(loc="best", fontsize=8)
        for axes in all_axes[-columns:]:
            axes.set_xlabel("time [s]")
            axes.tick_params(labelbottom=True)
    return figure


def error_figure(run: MechanismRun) -> Figure:
    """Distance and angle of each joint and free body from its desired position, over time."""
    log, parts = run.log, run.built.parts()

    def errors(rows: Array) -> tuple[Array, Array]:
        values = run.built.part_errors(rows).values()
        return np.column_stack([e[0] for e in values]), np.column_stack([e[1] for e in values])

    groups = []
    for which, values in enumerate(by_pieces(errors, log["way_off"])):
        label, scale = (("distance [mm]", 1e3), ("angle [deg]", np.degrees(1.0)))[which]
        names = {k: name for k, name in enumerate(parts) if parts[name][which]}
        groups.append((label, scale, names, values))
    missed = np.asarray(log["feasible"][1:, 0]) == 0.0 if "feasible" in log else None
    words = "Joints and free bodies against their wanted positions"
    return _side_by_side(run, words, groups, missed=missed)


def motor_figure(run: MechanismRun) -> Figure:
    """Forces and moments of the motors of joints over time."""
    rows, names, turns = run.built.motors(), run.built.velocity_names(), run.built.turns()
    forces, groups = run.log["motor_forces"][run.first :], []
    for turning, label in ((False, "force [N]"), (True, "moment [N m]")):
        labels = {k: names[row] for k, row in enumerate(rows) if turns[row] == turning}
        groups.append((label, 1.0, labels, forces))
    return _side_by_side(run, "What the motors of joints do", groups, run.first)


def _side_by_side(
    run: MechanismRun, words: str, groups: Sequence[tuple[str, float, dict[int, str], Array]],
    first: int = 0, missed: np.ndarray | None = None,
) -> Figure:  # fmt: skip
    """A panel for each group with curves: label, factor, names by columns, values."""
    groups, times = [group for group in groups if group[2]], run.log["time"][first:]
    figure, axes = new_figure(1, len(groups), (6.0 * len(groups) + 3.0, 5.0), run.title(words))
    for panel, (label, scale, names, values) in zip(np.atleast_1d(axes), groups, strict=True):
        columns = list(names)
        curves(panel, times, values[:, columns], [*names.values()], numbers=columns, scale=scale)
        panel.set(xlabel="time [s]", ylabel=label)
        if missed is not None and np.any(missed):
            shade(panel, times[1:], missed, "no tensions\nwithin the limits")
        panel.margins(x=0.01)
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    return figure
