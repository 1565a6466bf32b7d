"""Runs of picking and placing: how one steps, its numbers and its figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Box
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    line_style,
    new_figure,
    shade,
    shared_legend,
)
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.runs.checks import check_length
from cdpr_drake.analyses.runs.engine import DiagramEngine, Engine
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.live_view import Prepare, live_pick_and_place
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import ShownThing, ShownView, Surroundings
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row, pose_rows_distance
from cdpr_drake.models.rendered_camera import probe_rendering
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.scene import plate_geometry
from cdpr_drake.palette import (
    CAMERA,
    ESTIMATED,
    LOST,
    PLATFORM,
    SECOND_CAMERA,
    SHADED,
    TARGET,
    nth_look,
)
from cdpr_drake.systems.cameras.camera_settings import RENDERED
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.cameras import pinholes
from cdpr_drake.systems.pick_and_place.gripper import HOLDING
from cdpr_drake.systems.pick_and_place.handling_step import camera_poses
from cdpr_drake.systems.pick_and_place.pick_and_place import PickAndPlace, build_pick_and_place
from cdpr_drake.systems.pick_and_place.pick_and_place_task import (
    FAILURE_WORDS,
    Failure,
    Phase,
    PickAndPlaceState,
)
from cdpr_drake.systems.pick_and_place.tag_occlusion import COVER_COLOR, cover_plate
from cdpr_drake.systems.pick_and_place.workpiece import GRIPPER_COLOR, placed_tags, stem
from cdpr_drake.systems.robots.settings import model_words, simulated_model
from cdpr_drake.systems.scenarios.files import PICK_AND_PLACE
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import COVERED_IN, OBJECT_TAG

NEEDED = {
    Phase.APPROACH: "found_object", Phase.DESCEND: "found_object",
    Phase.CARRY: "found_goal", Phase.LOWER: "found_goal",
}  # fmt: skip
"""The tag that a phase needs, by the quantity of the log that is 0 while it is not seen."""

BOX_COLOR = (0.80, 0.62, 0.25, 1.0)
SUB_MILLIMETRE = 1e-2
"""Lower end of the axis of distances [mm]."""


class PickAndPlaceRun(Run):
    """A run of picking and placing; it ends COMPLETED, FAILED, TIMEOUT, DIVERGED or INTERRUPTED.

    Attributes:
        state: State of the task at the end; None if only the log is left.
    """

    kind = PICK_AND_PLACE
    state: PickAndPlaceState | None = None

    @cached_property
    def built(self) -> PickAndPlace:
        """The diagram and its handles."""
        return build_pick_and_place(self.scenario)

    def check(self) -> list[str]:
        if self.scenario.camera.kind == RENDERED:
            probe_rendering()
        self.built.make_context()
        check_length(self.scenario, self.built.max_step)
        return []

    def engine(self, follow: Follow, resume: bool) -> DiagramEngine:
        scenario, built = self.scenario, self.built
        return DiagramEngine(
            built, scenario.integration.integrator, built.max_step, scenario.duration,
            1.0 / scenario.handling.rate, lambda context, _: self._outcome(context),
            lambda context: pose_error(built.X_WG, built.box_pose(context)),
        )  # fmt: skip

    def _state(self, context: Any) -> PickAndPlaceState:
        return self.built.machine.state(self.built.machine.GetMyContextFromRoot(context))

    def _outcome(self, context: Any) -> Outcome:
        p = self.built.platform_pose(context).translation()
        lower, upper = self.robot.frame.bounds()
        if np.any(p < lower) or np.any(p > upper):
            return Outcome.DIVERGED
        phase = self._state(context).phase
        if phase in (Phase.DONE, Phase.FAILED):
            return Outcome.COMPLETED if phase is Phase.DONE else Outcome.FAILED
        over = context.get_time() >= self.scenario.duration * (1.0 - 1e-12)
        return Outcome.TIMEOUT if over else Outcome.RUNNING

    def note(self, engine: Engine) -> None:
        """Notes the task's state, and why it was not done, with the phase in which it ended."""
        assert isinstance(engine, DiagramEngine)
        self.state = state = self._state(engine.context)
        if self.message or self.outcome == Outcome.COMPLETED:
            return
        if self.outcome != Outcome.FAILED:
            self.message = f"ended in phase {state.phase.word}"
            return
        self.message = f"{state.failed_in.word}: {FAILURE_WORDS[state.failure]}"
        gripper = self.built.gripper
        grip, law = gripper.status(gripper.GetMyContextFromRoot(engine.context)), gripper.law
        if state.failure is Failure.NOT_GRASPED:
            self.message += (
                f"; found {1e3 * grip[1]:.2f} mm along, {1e3 * grip[2]:.2f} mm across, "
                f"{np.degrees(grip[3]):.2f} deg; accepted: at most {1e3 * law.reach:g} mm, "
                f"{1e3 * law.sideways:g} mm, {np.degrees(law.tilt):g} deg"
            )
        elif state.failure is Failure.DROPPED:
            self.message += f"; largest force {grip[4]:.3g} N, gripper.strength {law.strength:g} N"

    def end_error(self) -> tuple[float, float]:
        return pose_error(self.built.X_WG, pose_from_row(self.log["X_WB"][-1]))

    def spans(self) -> dict[Phase, tuple[float, float]]:
        """Begin and end of each phase [s]."""
        times, numbers = self.log["time"], np.asarray(self.log["phase"])
        spans = {}
        for number in np.unique(numbers[:, 0]).astype(int):
            rows = np.flatnonzero(numbers[:, 0] == number)
            last = rows[-1] + 1
            end = float(numbers[last, 1] if last < len(numbers) else times[-1])
            spans[Phase(int(number))] = (float(numbers[rows[0], 1]), end)
        return spans

    def unseen(self) -> np.ndarray:
        """Rows at which the tag that the phase needs is not seen, shape (n,), bool."""
        numbers = np.asarray(self.log["phase"])[:, 0]
        missing = np.zeros(len(numbers), bool)
        for phase, name in NEEDED.items():
            missing |= (numbers == phase) & (np.asarray(self.log[name])[:, 0] == 0.0)
        return missing

    def hidden(self) -> np.ndarray:
        """Rows at which a plate hides a tag, shape (n,), bool."""
        if "hidden" not in self.log:
            return np.zeros(len(self.log["time"]), bool)
        return np.asarray(np.asarray(self.log["hidden"])[:, 0] > 0.0)

    def numbers(self) -> dict[str, Any]:
        log, scenario, built, state = self.log, self.scenario, self.built, self.state
        X_WB = pose_from_row(log["X_WB"][-1])
        distance, angle = self.end_error()
        offset = (built.X_WG.inverse() @ X_WB).translation()
        placed = self.outcome == Outcome.COMPLETED
        grip, end, tensions = np.asarray(log["grip"]), float(log["time"][-1]), log["tensions"]
        load = np.asarray(log["load"])[grip[:, 0] == HOLDING, 0]
        covered = np.asarray(log["hidden"])[:, 0] if scenario.cover is not None else np.zeros(1)
        places = {
            "taken_from": (built.X_WB, scenario.workpiece),
            "goal": (built.X_WG, scenario.goal),
        }
        return {
            "scenario": scenario.name,
            "kind": scenario.kind,
            "robot": built.robot.name,
            "simulated": simulated_model(built.robot, scenario.cables, scenario.damping),
            "geometry": scenario.cables.geometry_words(built.robot),
            "camera": scenario.camera.kind,
            "seed": scenario.seed,
            **self.ending(),
            "set_down_error_m": distance if placed else None,
            "set_down_error_rad": angle if placed else None,
            "set_down_offset_m": offset.tolist() if placed else None,
            "box_from_goal_m": distance,
            "phases": {
                phase.word: {"began_s": begin, "duration_s": end - begin}
                for phase, (begin, end) in self.spans().items()
                if phase not in (Phase.DONE, Phase.FAILED)
            },
            "views": {
                "losses": None if state is None else int(state.losses),
                "blind_s": None if state is None else state.blind_time,
                "unseen_s": float(np.mean(self.unseen())) * end,
                "hidden_s": float(np.mean(covered)) * end,
            },
            "grip": {
                "gap_m": float(grip[-1, 1]),
                "across_m": float(grip[-1, 2]),
                "tilt_rad": float(grip[-1, 3]),
                "largest_force_n": float(np.max(grip[:, 4])),
                "mean_load_n": float(np.mean(load)) if len(load) else None,
            },
            "box": {
                key: {
                    "position": X_WF.translation().tolist(),
                    "expected": settings.pose.position.tolist(),
                }
                for key, (X_WF, settings) in places.items()
            },
            "tension_n": {"min": float(np.min(tensions)), "max": float(np.max(tensions))},
            "integration_step_s": built.max_step,
            "versions": self.versions(),
        }  # fmt: skip

    def facts(self, summary: Mapping[str, Any]) -> list[tuple[str, str]]:
        error, views, tension = summary["set_down_error_m"], summary["views"], summary["tension_n"]
        if error is None:
            words = f"not set down; box {1e3 * summary['box_from_goal_m']:.1f} mm from the goal"
        else:
            angle = np.degrees(summary["set_down_error_rad"])
            words = f"{1e3 * error:.3f} mm, {angle:.3f} deg from the goal"
        times = ", ".join(
            f"{name} {span['duration_s']:.1f}" for name, span in summary["phases"].items()
        )
        view = f"{views['unseen_s']:.2f} s without the tag that was needed"
        if views["hidden_s"] > 0.0:
            view += f"; a tag was hidden for {views['hidden_s']:.2f} s"
        return [
            ("model", model_words(summary["simulated"])), ("set down", words),
            ("phases [s]", times), ("view", view),
            ("tensions", f"{tension['min']:.2f} to {tension['max']:.2f} N"),
        ]  # fmt: skip

    def subtitle(self) -> str:
        scenario, outcome = self.scenario, self.outcome.name.lower()
        cameras = f"{scenario.camera.kind} cameras, seed {scenario.seed}"
        return f"{scenario.cables.geometry_words(self.robot)}, {cameras}, {outcome}"

    def main_figures(self) -> dict[str, Callable[[], Figure]]:
        return {
            "phases": partial(phase_figure, self),
            "way": partial(way_figure, self),
            "tensions": lambda: cable_figure(
                self.title("Tensions of the cables"), self.robot, self.log, "tensions",
                "tension [N]", bounds=self.robot.tension_limits(),
            ),
        }  # fmt: skip

    def live(self, meshcat: Any) -> Prepare:
        return live_pick_and_place(self.scenario, meshcat, shown_things(self.scenario))

    def replay(self, path: Path) -> None:
        scenario = self.scenario
        write_replay(
            path, self.robot, self.log, cables=scenario.cables, title=self.heading,
            around=Surroundings(scenario.world, tuple(shown_things(scenario))),
        )  # fmt: skip


def shown_things(scenario: PickAndPlaceScenario) -> list[ShownThing | ShownView]:
    """Box, tags, gripper, cameras and the plate over a tag of a scenario, for replays."""
    on_box, at_goal = placed_tags(scenario)
    size = [float(edge) for edge in scenario.workpiece.size]
    things: list[ShownThing | ShownView] = [
        ShownThing("box", Box(*size), BOX_COLOR, quantity="X_WB")
    ]
    for name, tag, pose, quantity in (
        ("box_tag", scenario.workpiece.tag, on_box, "X_WB"),
        ("goal_tag", scenario.goal.tag, at_goal, None),
    ):
        plate = plate_geometry(tag.target().plates()[0], RigidTransform(), name)
        things.append(ShownThing(name, plate.shape(), X_FG=pose, quantity=quantity))
    grip, X_PStem = stem(scenario.gripper.tip)
    things.append(ShownThing("gripper", grip, tuple(GRIPPER_COLOR), X_PStem, "X_WP"))
    if scenario.cover is not None:
        covers_box = COVERED_IN[scenario.cover.phase] == OBJECT_TAG
        tag = scenario.workpiece.tag if covers_box else scenario.goal.tag
        X_WT = scenario.places()[0] @ on_box if covers_box else at_goal
        shape, X_TPlate = cover_plate(tag.size)
        color, pose = tuple(COVER_COLOR), X_WT @ X_TPlate
        things.append(ShownThing("cover", shape, color, pose, while_positive="hidden"))
    robot = load_robot(scenario.robot)
    at_box, at_goal = camera_poses(scenario, robot, believed=False)
    first, second = pinholes(scenario, robot)
    if scenario.goal_camera is None:
        return [*things, ShownView("camera", "view of the camera", first, CAMERA, at_box, "X_WP")]
    words = "view of the camera for the"
    return [
        *things,
        ShownView("box_camera", f"{words} box", first, CAMERA, at_box, "X_WP"),
        ShownView("goal_camera", f"{words} goal", second, SECOND_CAMERA, at_goal, "X_WP"),
    ]


def phase_figure(run: PickAndPlaceRun) -> Figure:
    """Box and platform over time, with the phases, and when a tag was hidden or not seen."""
    log, times, spans = run.log, np.asarray(run.log["time"]), run.spans()
    goal = np.tile(pose_row(run.built.X_WG), (len(times), 1))
    distance, angle = pose_rows_distance(log["X_WB"], goal)
    drift, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    figure, axes = new_figure(3, 1, (11.0, 10.0), run.title("Picking and placing, by phases"))
    for name, look, label in (("X_WP", PLATFORM, "platform, Po"), ("X_WB", TARGET, "box, Bo")):
        draw_curve(axes[0], times, np.asarray(log[name])[:, 6], look, label, scale=1e3)
    axes[0].set(ylabel="height z in W [mm]")
    off = np.column_stack([1e3 * distance, np.degrees(angle)])
    words = ("box from the goal, distance [mm]", "box from the goal, angle [deg]")
    curves(axes[1], times, off, words, numbers=(2, 3))
    axes[1].set(ylabel="from the goal [mm], [deg]", yscale="log", ylim=(SUB_MILLIMETRE, None))
    draw_curve(axes[2], times, drift, ESTIMATED, "platform against its dead reckoning", scale=1e3)
    axes[2].set(ylabel="error of dead reckoning [mm]", xlabel="time [s]")
    for panel in axes:
        shade(panel, times, run.hidden(), "tag hidden", LOST)
        shade(panel, times, run.unseen() & ~run.hidden(), "tag that is needed not seen", SHADED)
        for begin, _ in spans.values():
            panel.axvline(begin, color=SHADED.color, linewidth=0.8, zorder=0)
    shared_legend(figure, axes, ncols=3)
    for phase, (begin, end) in spans.items():
        if end - begin >= 0.02 * times[-1]:
            axes[0].annotate(
                phase.word, (0.5 * (begin + end), 1.0), xycoords=("data", "axes fraction"),
                ha="center", va="bottom", fontsize=8, rotation=35,
            )  # fmt: skip
    return figure


def way_figure(run: PickAndPlaceRun) -> Figure:
    """The box's and the platform's way from above and from the side, phase by phase."""
    title = run.title("Way of the platform P, phase by phase, and of the box B")
    figure, axes = new_figure(1, 2, (13.0, 6.5), title)
    platform, box = (1e3 * np.asarray(run.log[name])[:, 4:] for name in ("X_WP", "X_WB"))
    numbers, dark = np.asarray(run.log["phase"])[:, 0], np.flatnonzero(run.hidden())
    goal, kept_box = 1e3 * run.built.X_WG.translation(), path_rows(box)
    for panel, (across, up) in zip(axes, ((0, 1), (0, 2)), strict=True):
        for phase in run.spans():
            rows = np.flatnonzero(numbers == phase)
            if phase in (Phase.DONE, Phase.FAILED) or len(rows) == 0:
                continue
            shown_rows, look = rows[path_rows(platform[rows])], nth_look(int(phase))
            panel.plot(
                platform[shown_rows, across], platform[shown_rows, up], label=phase.word,
                marker=look.marker, markevery=max(1, len(shown_rows) // 4), **line_style(look),
            )  # fmt: skip
        if len(dark):
            panel.plot(
                platform[dark, across], platform[dark, up], color=LOST.color, linewidth=7.0,
                alpha=0.35, zorder=0, label="tag hidden",
            )  # fmt: skip
        panel.plot(
            box[kept_box, across], box[kept_box, up], label="box", linewidth=1.0,
            **line_style(TARGET),
        )  # fmt: skip
        panel.plot(goal[across], goal[up], "k+", markersize=14, label="goal")
        panel.set(xlabel="x in W [mm]", ylabel=f"{'xyz'[up]} in W [mm]", aspect="equal")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure
