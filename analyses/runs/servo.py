"""Runs of visual servos: how one steps, its numbers and its facts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform
from pydrake.systems.analysis import SimulatorStatus

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.thinning import by_pieces
from cdpr_drake.analyses.runs import servo_figures as drawn
from cdpr_drake.analyses.runs.checks import (
    check_length,
    check_start,
    contact_warnings,
    goal_warnings,
    servo_limit_warnings,
    sheave_warnings,
    step_warnings,
)
from cdpr_drake.analyses.runs.engine import DiagramEngine, Engine, LoopEngine
from cdpr_drake.analyses.runs.log import spread
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.runs.sensing import SENSING
from cdpr_drake.analyses.runs.stability import STABILITY, Stability, stability_of_run
from cdpr_drake.analyses.runs.subjects import (
    BEHAVIOUR,
    FAILURES,
    MOTORS,
    TENSION_GAIN,
    WANTED_TENSIONS,
    WORLD,
    world_facts,
    world_names,
    world_numbers,
)
from cdpr_drake.analyses.runs.unexpected_end import servo_message
from cdpr_drake.analyses.visualization.live_view import Prepare, live_servo
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_from_row, pose_row, pose_rows_distance
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.models.rendered_camera import probe_rendering
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.systems.cameras.camera_settings import RENDERED
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.diagrams.calibration_findings import calibration_facts, found_calibrations
from cdpr_drake.systems.diagrams.torque_control import loop_warnings, tension_limits
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import check_loop, uses_compiled_loop
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.monitoring.tension_watch import TensionExtremes
from cdpr_drake.systems.robots.settings import COMPILED, model_words, simulated_model
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.run_settings import DIAGRAM, engine_of
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.vision.target import PointTarget

THESIS_WIDTH = 1600
"""Width of the image in which the servoing thesis counts pixels."""

ROUNDING = 1e-9
"""Share of a limit that a rate of wanted tensions may be beyond it: differences of sums."""


@dataclass(frozen=True)
class TorqueSteps:
    """What a servo by torque did at all steps of its control, of which the log has some.

    Attributes:
        steps: Steps of its control.
        relaxed: Steps at which no tensions within the limits gave the wrench.
        largest_rate: Largest rate of a taut cable's commanded tension [N/s].
        extremes: Extremes of the true tensions.
        limits: Smallest and largest accepted tension [N].
    """

    steps: int
    relaxed: int
    largest_rate: float
    extremes: TensionExtremes
    limits: tuple[float, float]

    def numbers(self, settings: TorqueControl) -> dict[str, Any]:
        """Numbers; the lower limit counts from when all cables first pulled with it."""
        (low, high), rate, extremes = self.limits, settings.tension_rate, self.extremes
        lowest, highest = float(np.min(extremes.lowest)), float(np.max(extremes.highest))
        excess = float("nan")
        if np.isfinite(extremes.taut_since):
            excess = max(low - lowest, highest - high, 0.0)
        return {
            "steps": self.steps,
            "relaxed_share": self.relaxed / max(self.steps, 1),
            "taut_after_s": extremes.taut_since,
            "tension_limits_n": [low, high],
            "within_limits": excess == 0.0,
            "largest_excess_n": excess,
            "lowest_tension_n": lowest,
            "highest_tension_n": highest,
            "largest_rate_n_per_s": self.largest_rate,
            "rate_limit_n_per_s": rate,
            "rates_within_limit": self.largest_rate <= rate * (1.0 + ROUNDING),
        }


SUBJECTS = (
    MOTORS, WANTED_TENSIONS, BEHAVIOUR, *SENSING, TENSION_GAIN, FAILURES, WORLD, STABILITY,
)  # fmt: skip
"""Subjects of runs of visual servos, in the order of their numbers in a summary."""


class ServoRun(Run):
    """A run of a visual servo.

    Attributes:
        broken: Times at which cables passed their breaking load, or -1, shape (m,) [s].
        step_errors: Largest estimated errors of an integration step [m, rad].
        images: Images taken by a camera with a region of interest, and those drawn whole.
        torque: What a servo by torque did.
        loop: What steps it: compiled or diagram.

    Those that a run does not have, or that its log alone does not tell, are None.
    """

    kind = VISUAL_SERVO
    subjects = SUBJECTS
    broken = step_errors = None
    images: tuple[int, int] | None = None
    torque: TorqueSteps | None = None

    def __init__(self, scenario: Any) -> None:
        """Of a scenario, whose robot moves by the compiled engine in the compiled loop.

        Raises:
            ScenarioError: It is of another kind, or the compiled loop cannot run it.
        """
        super().__init__(scenario)
        self.loop = COMPILED if uses_compiled_loop(scenario) else DIAGRAM
        if self.loop == COMPILED:
            self.scenario = check_loop(scenario)

    @cached_property
    def built(self) -> Any:
        """The diagram and its handles, or what a loop without one is of."""
        if self.loop == COMPILED:
            return ServoLoop(self.scenario).servo()
        return build_visual_servo(self.scenario)

    def check(self) -> list[str]:
        scenario = self.scenario
        renders = any(section.needs_rendering for _, section in sections_of(scenario))
        if scenario.camera.kind == RENDERED or renders:
            probe_rendering()
        if self.loop == DIAGRAM:
            self.built.make_context()
        check_start(self.built)
        check_length(scenario, self.built.max_step)
        return [
            *step_warnings(self.built), *contact_warnings(scenario, self.robot),
            *(f"{scenario.name}: {words}" for words in servo_limit_warnings(scenario, self.robot)),
            *loop_warnings(scenario, self.robot), *sheave_warnings(scenario, self.robot),
            *goal_warnings(self.built),
        ]  # fmt: skip

    def engine(self, follow: Follow, resume: bool) -> Engine:
        scenario, built = self.scenario, self.built
        if self.loop == COMPILED:
            if follow.prepare is not None:
                raise ScenarioError(
                    f"{scenario.name}: integration.loop: found compiled, but Meshcat looks into a "
                    "diagram; accepted: diagram or automatic"
                )
            loop = ServoLoop(scenario)
            errors = lambda: built.seen_error(loop.true_pose(), loop.time)  # noqa: E731
            log, outcome = loop.log, partial(self._loop_outcome, loop)
            return LoopEngine(loop, log, log.read, scenario.duration, outcome, errors)
        method = scenario.integration.integrator
        if method not in explicit_integrators():  # the robot moves by itself
            method = "runge_kutta3"
        return DiagramEngine(
            built, method, built.max_step, scenario.duration, 1.0 / scenario.camera.rate,
            self._outcome,
            lambda context: built.seen_error(built.true_pose(context), context.get_time()),
        )  # fmt: skip

    def _loop_outcome(self, loop: ServoLoop) -> Outcome:
        over = loop.time >= self.scenario.duration * (1.0 - 1e-12)
        return Outcome.TIMEOUT if over and loop.outcome == Outcome.RUNNING else loop.outcome

    def _outcome(self, context: Any, status: SimulatorStatus) -> Outcome:
        built = self.built
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            if status.system() is built.watch:
                return Outcome.CABLE_BROKEN
            if built.meters is not None and status.system() is built.meters.stop:
                return Outcome.CONTACT
            return built.monitor.outcome(built.monitor.GetMyContextFromRoot(context))
        over = context.get_time() >= self.scenario.duration * (1.0 - 1e-12)
        return Outcome.TIMEOUT if over else Outcome.RUNNING

    def note(self, engine: Engine) -> None:
        """Notes breaks, torques, images and errors of steps."""
        built, diverged = self.built, self.outcome == Outcome.DIVERGED
        if isinstance(engine, LoopEngine):
            self.step_errors = None if diverged else engine.loop.step_errors()
            return
        assert isinstance(engine, DiagramEngine)
        context, torque = engine.context, built.torque
        if built.watch is not None:
            self.broken = built.watch.broken(built.watch.GetMyContextFromRoot(context))
        self.step_errors = None if diverged else built.step_errors(context)
        self.images = built.images(context)
        for _, section in sections_of(self.scenario):
            self.at_end |= section.at_end(built, context)
        if torque is not None and built.tension_range is not None:
            own, watch = torque.GetMyContextFromRoot(context), built.tension_range
            steps, relaxed = torque.steps(own)
            self.torque = TorqueSteps(
                steps, relaxed, torque.largest_rate(own),
                watch.extremes(watch.GetMyContextFromRoot(context)),
                tension_limits(self.scenario, built.robot),
            )  # fmt: skip

    def log_names(self) -> dict[str, Sequence[str] | str]:
        world = world_names(self.scenario.world)
        return super().log_names() | {"error": self.built.feature_names} | world

    def end_error(self) -> tuple[float, float]:
        return self.built.seen_error(
            pose_from_row(self.log["X_WP"][-1]), float(self.log["time"][-1])
        )

    @cached_property
    def stability(self) -> Stability | None:
        """The stability criterion along the run, where it was followed or is about tensions."""
        return stability_of_run(self)

    @cached_property
    def image_path(self) -> tuple[Array, Array, Array]:
        """Path of the target's middle in the image, as measured, and the line it should follow.

        Returns:
            Times, shape (n,) [s]; path, shape (n, 2) [px]; the line's start and end, shape (2, 2)
            [px]: the path's first point and the image of the desired pose. Empty if never found.
        """
        log, target, pinhole = self.log, self.built.target, self.built.pinhole
        rows = np.flatnonzero(log["found"][:, 0] > 0.0)
        path = np.empty((0, 2))
        if len(rows):
            marks, poses = log[f"{target.mark}_px"][rows], log["X_CO_measured"][rows]
            path = by_pieces(lambda m, p: target.centers(m, p[:, 4:], pinhole), marks, poses)
        path = path * [pinhole.fx, pinhole.fy] + [pinhole.cx, pinhole.cy]
        desired = pinhole.ideal.project(self.built.X_CdO.translation()[:, np.newaxis])[:, 0]
        return log["time"][rows], path, np.array([path[0] if len(path) else desired, desired])

    @cached_property
    def start_frame(self) -> RigidTransform:
        """The frame of paths of the camera: that which the object has at the start, in its own
        coordinates those of W; for eye to hand O itself."""
        return RigidTransform() if self.built.mounting.is_eye_to_hand() else self.built.X_WO

    def X_OC(self, row: int) -> RigidTransform:
        """Pose of the camera as the object sees it at a row of the log."""
        X_WP, time = pose_from_row(self.log["X_WP"][row]), float(self.log["time"][row])
        return self.built.X_CO(X_WP, time).inverse()

    @property
    def camera_line(self) -> Array:
        """The straight line from the camera's first place to where the desired pose puts it,
        shape (2, 3) [m]."""
        ends = self.X_OC(0), self.built.X_CdO.inverse()
        return np.array([self.start_frame @ X.translation() for X in ends])

    @cached_property
    def camera_path(self) -> Array:
        """True path of the camera in `start_frame`, shape (n, 3) [m]."""
        built, poses = self.built, self.log["X_WP"]
        if not built.mounting.is_eye_to_hand() and not built.motion.is_moving():
            p_PC = built.X_PC.translation()
            return by_pieces(lambda X: rotations_of_quaternions(X[:, :4]) @ p_PC + X[:, 4:], poses)
        times = self.log["time"]
        X_CO = (built.X_CO(pose_from_row(row), t) for row, t in zip(poses, times, strict=True))
        return np.array([self.start_frame @ X.inverse().translation() for X in X_CO])

    def distances(self, quantity: str) -> tuple[Array, Array]:
        """Distance [m] and angle [rad] of a logged pose from the true one; empty without it."""
        if quantity not in self.log:
            return np.empty(0), np.empty(0)
        return by_pieces(pose_rows_distance, self.log["X_WP"], self.log[quantity])

    @np.errstate(over="ignore", invalid="ignore")  # a diverged run has any numbers
    def numbers(self) -> dict[str, Any]:
        log, built, scenario = self.log, self.built, self.scenario
        position_error, rotation_error = self.end_error()
        (estimate_distance, estimate_angle), time = self.distances("X_WP_estimated"), log["time"]
        plan_distance, plan_angle = self.distances("X_WP_planned")
        pixels, metres = np.empty(0), np.empty(0)
        if not built.motion.is_moving():  # no line is the ideal one then
            pixels = distances_from_line(self.image_path[1], *self.image_path[2])
            metres = distances_from_line(self.camera_path, *self.camera_line)
        tensions, slack, pause = log["tensions"], log["slack"], np.diff(time)
        taut = np.sum(slack <= 0.0, axis=1)
        freedom = 3 if built.believed.is_planar() else 6
        nothing = dict.fromkeys(("least_stability_margin", "least_jacobian_rank", "unstable_s"))
        steps = self.step_errors
        return {
            "scenario": scenario.name,
            "robot": built.robot.name,
            "geometry": scenario.cables.geometry_words(built.robot, scenario.controller.pulleys),
            "controller": scenario.controller.scheme if scenario.open_loop is None else "open_loop",
            "servo_switches": int(log["servo_mode"][-1, 1]) if "servo_mode" in log else None,
            "estimator": scenario.estimator.kind,
            "camera": scenario.camera.kind,
            "images": self.images and dict(zip(("taken", "whole"), self.images, strict=True)),
            "seed": scenario.seed,
            **self.ending(),
            "message": self.message or servo_message(self),
            "final_position_error_m": position_error,
            "final_rotation_error_rad": rotation_error,
            "final_pose_estimate_error_m": float(estimate_distance[-1]),
            "final_pose_estimate_error_rad": float(estimate_angle[-1]),
            "pose_estimate_error_m": spread(estimate_distance),
            "pose_estimate_error_rad": spread(estimate_angle),
            "pose_estimate_drift_m_per_min": drift(time, estimate_distance),
            "pose_estimate_drift_rad_per_min": drift(time, estimate_angle),
            "plan_deviation_m": spread(plan_distance),
            "plan_deviation_rad": spread(plan_angle),
            "image_deviation_px": spread(pixels),
            "image_deviation_px_1600x1200": spread(pixels * THESIS_WIDTH / built.pinhole.width),
            "camera_deviation_m": spread(metres),
            "tension_n": {"min": float(np.min(tensions)), "max": float(np.max(tensions))},
            "calibration": found_calibrations(log["fusion_calibration"][-1])
            if "fusion_calibration" in log
            else None,
            "broken_cables": None if self.broken is None else [
                {"cable": cable.name, "time_s": float(instant)}
                for cable, instant in zip(built.robot.cables, self.broken, strict=True)
                if instant >= 0.0
            ],
            "slack_cable_seconds": float(np.sum(slack[:-1] * pause[:, None])),
            "taut_cables": {"min": int(np.min(taut)), "end": int(taut[-1])},
            "underactuated_s": float(np.sum(pause * (taut[:-1] < freedom))),
            **(nothing if self.stability is None else self.stability.numbers()),
            "torque_control": self.torque
            and self.torque.numbers(scenario.torque_control or TorqueControl()),
            "simulated": simulated_model(built.robot, scenario.cables, scenario.damping),
            "world": world_numbers(self),
            "surplus_over_chord_m": spread(log["surplus_lengths"].ravel()),
            "engine": engine_of(scenario),
            "loop": self.loop,
            "integration_step_s": built.max_step,
            "step_error": None if steps is None else {"m": float(steps[0]), "rad": float(steps[1])},
            "remarks": servo_limit_warnings(scenario, built.robot),
            "versions": self.versions(),
        }  # fmt: skip

    def facts(self, summary: Mapping[str, Any]) -> list[tuple[str, str]]:
        def error(position: str, rotation: str) -> str:
            return f"{1e3 * summary[position]:.3f} mm, {np.degrees(summary[rotation]):.3f} deg"

        deviation = summary["image_deviation_px"]["max"]
        camera = summary["camera_deviation_m"]["max"]
        image = "target never found" if deviation is None else f"{deviation:.2f} px in the image"
        line = "the target moves" if camera is None else f"{image}, {1e3 * camera:.1f} mm in space"
        tension, slack = summary["tension_n"], summary["slack_cable_seconds"]
        pulled = f"{tension['min']:.2f} to {tension['max']:.2f} N"
        plan, turn = summary["plan_deviation_m"]["max"], summary["plan_deviation_rad"]["max"]
        way = ("from the straight line", line)
        if plan is not None:
            way = ("from the plan", f"{1e3 * plan:.2f} mm, {np.degrees(turn):.3f} deg")
        estimate = "final_pose_estimate_error_m", "final_pose_estimate_error_rad"
        facts = [
            ("model", model_words(summary["simulated"])),
            ("final error", error("final_position_error_m", "final_rotation_error_rad")),
            ("pose estimate, error", error(*estimate)),
            way,
            ("tensions", f"{pulled}, {slack:.1f} cable seconds slack"),
        ]  # fmt: skip
        if (images := summary["images"]) is not None:
            facts.append(("images", f"{images['taken']}, of which {images['whole']} whole"))
        facts += [*calibration_facts(summary["calibration"]), *world_facts(summary)]
        if (torque := summary["torque_control"]) is not None:
            instant, off = torque["taut_after_s"], torque["largest_excess_n"]
            words = "never all taut" if instant is None else f"all taut after {instant:.2f} s"
            if off is not None:
                limits = "within the limits" if off == 0.0 else f"{off:.2f} N beyond the limits"
                words += f", from then on {limits}"
            share = 100.0 * torque["relaxed_share"]
            facts.append(("by torque", f"{words}; wrench infeasible in {share:.1f} % of steps"))
        return facts

    def subtitle(self) -> str:
        geometry = self.scenario.cables.geometry_words(self.robot)
        return f"{geometry}, {self.scenario.camera.kind} camera, seed {self.scenario.seed}"

    def main_figures(self) -> dict[str, Callable[[], Figure]]:
        curves = {
            name: partial(drawn.cable_curves_figure, self, name) for name in drawn.CABLE_CURVES
        }
        return {
            "error": partial(drawn.error_figure, self),
            "image_path": partial(drawn.image_path_figure, self),
            "platform_path": partial(drawn.platform_path_figure, self),
            **{drawn.CABLE_CURVES[name][0]: draw for name, draw in curves.items()},
        }

    def live(self, meshcat: Any) -> Prepare:
        return live_servo(self.scenario, meshcat)

    def replay(self, path: Path) -> None:
        film = path.parent / drawn.FILM
        view = drawn.camera_view(self, film if film.is_file() else None)
        camera = (self.built.mounting, self.built.pinhole)
        scenario = replace(self.scenario, title=self.heading)
        write_replay(path, self.robot, self.log, scenario, camera=camera, view=view)

    def traces(self) -> dict[str, Array]:
        """Arrays that figures of many runs draw, in pixels of an image `THESIS_WIDTH` wide and SI
        units: paths in the image and in space with their straight lines, errors, tensions."""
        log, built, pinhole = self.log, self.built, self.built.pinhole
        scale, (image_time, path, line) = THESIS_WIDTH / pinhole.width, self.image_path
        distance, angle = self.distances("X_WP_estimated")
        ends = self.X_OC(-1), built.X_CdO.inverse()
        traces = {
            "time": log["time"],
            "image_time": image_time,
            "image_path": scale * path,
            "image_line": scale * line,
            "image_deviation": scale * distances_from_line(path, *line),
            "image_size": scale * np.array([pinhole.width, pinhole.height], float),
            "camera_path": self.camera_path,
            "camera_line": self.camera_line,
            "camera_deviation": distances_from_line(self.camera_path, *self.camera_line),
            "camera_ends": np.array([pose_row(self.start_frame @ X) for X in ends]),
            "platform_path": log["X_WP"][:, 4:],
            "estimate_path": log["X_WP_estimated"][:, 4:],
            "estimate_distance": distance,
            "estimate_angle": angle,
            "error": np.where(log["gain"] > 0.0, log["error"], np.nan),
            "cable_velocities": log["cable_velocities"],
            "tensions": log["tensions"],
        }
        target = built.target
        if target.size == 8 and isinstance(target, PointTarget):
            seen = scale * log[f"{target.mark}_px"][log["found"][:, 0] > 0.0]
            traces["corner_paths"] = seen.reshape(-1, 4, 2).astype(np.float32)
            traces["corner_goals"] = scale * pinhole.ideal.project(built.X_CdO @ target.points).T
        return traces


def drift(times: Array, errors: Array) -> float | None:
    """How fast an estimate gets worse: the slope of its error over time, per minute.

    A straight line fitted by least squares to the second half of the run, in which what the start
    was wrong by has settled. None where the second half has fewer than three rows.
    """
    later = times >= 0.5 * (times[0] + times[-1])
    t, e = times[later] - np.mean(times[later]), errors[later]
    return None if len(t) < 3 else float(60.0 * (t @ e) / (t @ t))
