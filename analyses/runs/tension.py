"""Runs of dynamic control by tensions: how one steps, its numbers and its figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import draw_curve, new_figure, shade
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.thinning import by_pieces, path_rows
from cdpr_drake.analyses.runs.checks import (
    check_length,
    contact_warnings,
    limit_warnings,
    sheave_warnings,
)
from cdpr_drake.analyses.runs.engine import DiagramEngine, Engine, LoopEngine, resting
from cdpr_drake.analyses.runs.log import spread
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.runs.subjects import (
    PROGRAM_STEPS,
    WORLD,
    world_facts,
    world_names,
    world_numbers,
)
from cdpr_drake.analyses.runs.unexpected_end import tension_message
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.live_view import Prepare, live_tension_control
from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import Surroundings
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CableGeometryError, DivergedError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import ANGLE, DESIRED, DISTANCE, PLATFORM
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControl,
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.settings import (
    CableSettings,
    model_words,
    simulated_model,
)
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.scenarios.run_settings import DIAGRAM, engine_of
from cdpr_drake.systems.sections import sections_of


class TensionRun(Run):
    """A run of dynamic control; it ends COMPLETED, CONTACT, DIVERGED, CLIENT_ENDED or INTERRUPTED.

    Attributes:
        loop: What stepped it: diagram, compiled, or a section's loop; None if only the log is left.
    """

    kind = TENSION_CONTROL
    subjects = (PROGRAM_STEPS, WORLD)
    loop: str | None = None

    @cached_property
    def built(self) -> TensionControl:
        """The diagram and its handles."""
        scenario = self.scenario
        robot, belief = load_robot(scenario.robot), scenario.perturbations.believed_robot
        believed = robot if belief is None else load_robot(belief)
        damping = scenario.damping.of(robot) if belief is None else None
        dynamics = platform_dynamics(believed, damping=damping)
        settings = TensionControlSettings(
            trajectory=scenario.trajectory.trajectory(),
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
            world=scenario.world,
            stop_at_contact=scenario.stop.contact,
            sections=[section for _, section in sections_of(scenario)],
            seed=scenario.seed,
            damping=scenario.damping,
        )
        return build_tension_control(robot, settings, log_rate=scenario.log_rate)

    def check(self) -> list[str]:
        self.built.make_context()
        check_length(self.scenario, self.scenario.integration.max_step)
        return [
            *contact_warnings(self.scenario, self.robot),
            *sheave_warnings(self.scenario, self.robot),
            *(f"{self.scenario.name}: {words}" for words in self._limit_warnings()),
        ]

    def _limit_warnings(self) -> list[str]:
        limits = self.scenario.distribution.limits
        return limit_warnings("distribution.limits", limits, self.robot)

    def engine(self, follow: Follow, resume: bool) -> Engine:
        scenario, built, rule = self.scenario, self.built, self.scenario.integration
        looks = follow.prepare is not None or resume
        if not looks and (make := self._loop_maker()) is not None:
            return self._loop_engine(make)
        self.loop = DIAGRAM
        engine = DiagramEngine(
            built, rule.integrator, rule.max_step, scenario.duration,
            2.0 / scenario.controller.rate,
            lambda context, status: self._outcome(built.pose(context), context.get_time(), status),
            built.errors,
        )  # fmt: skip
        self._count_anew()
        return engine

    def _loop_maker(self) -> Callable[[TensionControl, float], Any] | None:
        """What makes a loop without a diagram; None: it needs one."""
        if can_be_compiled(self.built):
            return TensionLoop
        makers = (section.tension_loop(self.built) for _, section in sections_of(self.scenario))
        return next((make for make in makers if make is not None), None)

    def _loop_engine(self, make: Callable[[TensionControl, float], Any]) -> LoopEngine:
        """A loop without a diagram."""
        scenario, built = self.scenario, self.built
        with suppress(CableGeometryError, DivergedError), resting(built.outside):  # loads kernels
            make(built, scenario.log_rate).advance_to(1.0 / scenario.controller.rate)
        self._count_anew()
        loop = make(built, scenario.log_rate)
        self.loop = loop.name
        outcome = lambda: self._outcome(loop.pose(), loop.time)  # noqa: E731
        return LoopEngine(
            loop, loop, loop.read_log, scenario.duration, outcome, loop.errors, built.outside
        )

    def _count_anew(self) -> None:
        """Counts steps of the run alone, without those that load kernels."""
        times = self.built.blocks.distributor.step_times
        if times is not None:
            times.restart(times.period)

    def _outcome(self, X_WP: RigidTransform, time: float, status: Any = None) -> Outcome:
        stop = None if self.built.meters is None else self.built.meters.stop
        if status is not None and stop is not None and status.system() is stop:
            return Outcome.CONTACT
        p, world = X_WP.translation(), self.scenario.world
        lower, upper = self.robot.frame.bounds()
        below = 0.0 if world is None else world.room_below()
        if np.any(p < lower - [0.0, 0.0, below]) or np.any(p > upper):
            return Outcome.DIVERGED
        over = time >= self.scenario.duration * (1.0 - 1e-12)
        return Outcome.COMPLETED if over else Outcome.RUNNING

    def log_names(self) -> dict[str, Sequence[str] | str]:
        return super().log_names() | world_names(self.scenario.world)

    def end_error(self) -> tuple[float, float]:
        rows = (np.asarray(self.log[name][-1:]) for name in ("X_WP", "X_WP_desired"))
        distance, angle = pose_rows_distance(*rows)
        return float(distance[-1]), float(angle[-1])

    def numbers(self) -> dict[str, Any]:
        log, scenario = self.log, self.scenario
        distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        tensions = log["tensions"][1:]  # the first row stands before the first control step
        return {
            "scenario": scenario.name,
            "kind": scenario.kind,
            "robot": self.robot.name,
            "geometry": self.geometry,
            "controller": "computed_torque",
            "method": scenario.distribution.method,
            "seed": scenario.seed,
            **self.ending(),
            "message": self.message or tension_message(self),
            "position_error_m": spread(distance) | {"final": float(distance[-1])},
            "rotation_error_rad": spread(angle) | {"final": float(angle[-1])},
            "tension_n": {
                "min": float(np.min(tensions, initial=np.inf)),
                "max": float(np.max(tensions, initial=-np.inf)),
            },
            "tension_limits_n": list(self.robot.tension_limits(scenario.limits())),
            "remarks": self._limit_warnings(),
            "infeasible_steps": int(log["failures"][-1, 0]),
            "simulated": simulated_model(self.robot, None, scenario.damping),
            "engine": engine_of(scenario),
            "loop": self.loop,
            "integration_step_s": scenario.integration.max_step,
            "world": world_numbers(self),
            "versions": self.versions(),
        }

    def facts(self, summary: Mapping[str, Any]) -> list[tuple[str, str]]:
        position, rotation = summary["position_error_m"], summary["rotation_error_rad"]
        tension, error = summary["tension_n"], f"{1e3 * position['max']:.4f} mm"
        span, method = "none yet", f"the {self._source}" if self._source else summary["method"]
        if tension["min"] is not None:
            span = f"{tension['min']:.2f} to {tension['max']:.2f} N"
        return [
            ("model", model_words(summary["simulated"])),
            ("largest error", f"{error}, {np.degrees(rotation['max']):.5f} deg"),
            ("tensions", f"{span} by {method}"),
            ("infeasible steps", str(summary["infeasible_steps"])),
            *world_facts(summary),
        ]

    @property
    def _source(self) -> str:
        """Who distributes tensions in the place of the method; empty: nobody."""
        return self.built.blocks.distributor.source

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `CableSettings.geometry_words`."""
        cables = self.scenario.cables
        believed = cables.pulleys and self.scenario.distribution.pulleys
        return CableSettings(pulleys=cables.pulleys).geometry_words(self.robot, believed)

    def subtitle(self) -> str:
        method = self.scenario.distribution.method.replace("_", " ")
        return f"tensions by the {self._source or method}, {self.geometry}"

    def main_figures(self) -> dict[str, Callable[[], Figure]]:
        return {
            "error": partial(error_figure, self),
            "tensions": partial(tension_figure, self),
            "cable_lengths": lambda: cable_figure(
                self.title("Lengths of the cables"), self.robot, self.log, "lengths",
                "cable length [m]",
            ),
            "platform_path": partial(platform_path_figure, self),
        }  # fmt: skip

    def live(self, meshcat: Any) -> Prepare:
        return live_tension_control(self.scenario, meshcat)

    def replay(self, path: Path) -> None:
        cables = CableSettings(model=ELASTIC, pulleys=self.scenario.cables.pulleys)
        write_replay(
            path, self.robot, self.log, cables=cables, title=self.heading,
            around=Surroundings(self.scenario.world),
            limits=self.robot.tension_limits(self.scenario.limits()),
        )  # fmt: skip


def error_figure(run: TensionRun) -> Figure:
    """Distance and angle of the platform from its desired pose over time."""
    log, time = run.log, run.log["time"]
    distance, angle = by_pieces(pose_rows_distance, log["X_WP"], log["X_WP_desired"])
    figure, axes = new_figure(1, 2, (12.0, 5.0), run.title("Platform against its desired pose"))
    for panel, values, look, scale, label in (
        (axes[0], distance, DISTANCE, 1e3, "position error [mm]"),
        (axes[1], angle, ANGLE, 180.0 / np.pi, "rotation error [deg]"),
    ):
        draw_curve(panel, time, values, look, scale=scale)
        panel.set(xlabel="time [s]", ylabel=label)
    missed = log["feasible"][1:, 0] == 0.0
    for panel in axes if np.any(missed) else ():
        shade(panel, time[1:], missed, "no tensions within the bounds")
        panel.legend(loc="best")
    return figure


def tension_figure(run: TensionRun) -> Figure:
    """Tensions with the bounds that the distribution keeps, from the first control step on."""
    controlled = {name: values[1:] for name, values in run.log.items()}
    return cable_figure(
        run.title("Commanded tensions of the cables"), run.robot, controlled, "tensions",
        "tension [N]", bounds=run.robot.tension_limits(run.scenario.limits()),
    )  # fmt: skip


def platform_path_figure(run: TensionRun) -> Figure:
    """Path of the platform, and the desired one: with the whole robot, and close up."""
    paths = []
    for name, label, look in (
        ("X_WP_desired", "platform, Po, desired", DESIRED), ("X_WP", "platform, Po", PLATFORM),
    ):  # fmt: skip
        points = run.log[name][:, 4:]
        paths.append(Path3D(np.asarray(points[path_rows(points)]), label, look))
    title = run.title("Path of the platform P in the world frame W")
    return path_figure(title, run.robot, run.scenario.cable_set(run.robot), run.log, paths)
