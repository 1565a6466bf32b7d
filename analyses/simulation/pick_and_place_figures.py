"""Figures, replay and files of a run of picking and placing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.geometry import Box, Meshcat
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    figure_writers,
    line_style,
    new_figure,
    shade,
    shared_legend,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.log_files import LogNames, write_json, write_log
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.pick_and_place_run import PickAndPlaceRun
from cdpr_drake.analyses.simulation.pick_and_place_summary import (
    phase_spans,
    summarize_pick_and_place,
    unseen,
)
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.live_view import Prepare, live_pick_and_place
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.analyses.visualization.shown_things import ShownThing, ShownView, Surroundings
from cdpr_drake.geometry.poses import pose_row, pose_rows_distance
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
from cdpr_drake.systems.pick_and_place.cameras import pinholes
from cdpr_drake.systems.pick_and_place.handling_step import camera_poses
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Phase
from cdpr_drake.systems.pick_and_place.tag_occlusion import COVER_COLOR, cover_plate
from cdpr_drake.systems.pick_and_place.workpiece import GRIPPER_COLOR, placed_tags, stem
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import COVERED_IN, OBJECT_TAG

BOX_COLOR = (0.80, 0.62, 0.25, 1.0)

SUB_MILLIMETRE = 1e-2
"""Lower end of the axis of distances [mm]."""


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
    red, green, blue, alpha = GRIPPER_COLOR
    things.append(ShownThing("gripper", grip, (red, green, blue, alpha), X_PStem, "X_WP"))
    if scenario.cover is not None:
        covers_box = COVERED_IN[scenario.cover.phase] == OBJECT_TAG
        tag = scenario.workpiece.tag if covers_box else scenario.goal.tag
        X_WT = scenario.places()[0] @ on_box if covers_box else at_goal
        plate_shape, X_TPlate = cover_plate(tag.size)
        red, green, blue, alpha = COVER_COLOR
        things.append(
            ShownThing(
                "cover", plate_shape, (red, green, blue, alpha), X_WT @ X_TPlate,
                while_positive="hidden",
            )
        )  # fmt: skip
    return [*things, *_shown_views(scenario)]


def _shown_views(scenario: PickAndPlaceScenario) -> list[ShownView]:
    """What its cameras see; one of them where it has one for both tags."""
    robot = load_robot(scenario.robot)
    at_box, at_goal = camera_poses(scenario, robot, believed=False)
    first, second = pinholes(scenario, robot)
    if scenario.goal_camera is None:
        return [ShownView("camera", "view of the camera", first, CAMERA, at_box, "X_WP")]
    return [
        ShownView("box_camera", "view of the camera for the box", first, CAMERA, at_box, "X_WP"),
        ShownView(
            "goal_camera", "view of the camera for the goal", second, SECOND_CAMERA, at_goal,
            "X_WP",
        ),
    ]  # fmt: skip


def live_view(scenario: PickAndPlaceScenario, meshcat: Meshcat) -> Prepare:
    """What lets Meshcat follow a run."""
    return live_pick_and_place(scenario, meshcat, shown_things(scenario))


def _title(run: PickAndPlaceRun, words: str) -> str:
    scenario = run.scenario
    geometry = scenario.cables.geometry_words(run.built.robot)
    seen = f"{geometry}, {scenario.camera.kind} cameras, seed {scenario.seed}"
    return f"{words}\n{scenario.title}\n({scenario.name}, {seen}, {run.outcome.name.lower()})"


def _is_hidden(run: PickAndPlaceRun) -> np.ndarray:
    log = run.log
    if "hidden" not in log:
        return np.zeros(len(log["time"]), bool)
    return np.asarray(np.asarray(log["hidden"])[:, 0] > 0.0)


def phase_figure(run: PickAndPlaceRun) -> Figure:
    """Box and platform over time, with the phases, and when a tag was hidden or not seen."""
    log, times = run.log, np.asarray(run.log["time"])
    goal = np.tile(pose_row(run.built.X_WG), (len(times), 1))
    distance, angle = pose_rows_distance(log["X_WB"], goal)
    drift, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    figure, axes = new_figure(3, 1, (11.0, 10.0), _title(run, "Picking and placing, by phases"))
    for name, look, label in (("X_WP", PLATFORM, "platform, Po"), ("X_WB", TARGET, "box, Bo")):
        draw_curve(axes[0], times, np.asarray(log[name])[:, 6], look, label, scale=1e3)
    axes[0].set(ylabel="height z in W [mm]")
    off = np.column_stack([1e3 * distance, np.degrees(angle)])
    words = ("box from the goal, distance [mm]", "box from the goal, angle [deg]")
    curves(axes[1], times, off, words, numbers=(2, 3))
    axes[1].set(ylabel="from the goal [mm], [deg]", yscale="log", ylim=(SUB_MILLIMETRE, None))
    draw_curve(axes[2], times, drift, ESTIMATED, "platform against its dead reckoning", scale=1e3)
    axes[2].set(ylabel="error of dead reckoning [mm]", xlabel="time [s]")
    spans = phase_spans(log)
    for one in axes:
        shade(one, times, _is_hidden(run), "tag hidden", LOST)
        shade(one, times, unseen(log) & ~_is_hidden(run), "tag that is needed not seen", SHADED)
        for begin, _ in spans.values():
            one.axvline(begin, color=SHADED.color, linewidth=0.8, zorder=0)
    shared_legend(figure, axes, ncols=3)
    for phase, (begin, end) in spans.items():
        if end - begin < 0.02 * times[-1]:
            continue
        axes[0].annotate(
            phase.word, (0.5 * (begin + end), 1.0), xycoords=("data", "axes fraction"),
            ha="center", va="bottom", fontsize=8, rotation=35,
        )  # fmt: skip
    return figure


def way_figure(run: PickAndPlaceRun) -> Figure:
    """The box's and the platform's way from above and from the side, phase by phase."""
    log, built = run.log, run.built
    title = _title(run, "Way of the platform P, phase by phase, and of the box B")
    figure, axes = new_figure(1, 2, (13.0, 6.5), title)
    platform, box = (np.asarray(log[name])[:, 4:] for name in ("X_WP", "X_WB"))
    numbers, hidden = np.asarray(log["phase"])[:, 0], _is_hidden(run)
    for one, (across, up) in zip(axes, ((0, 1), (0, 2)), strict=True):
        for phase in phase_spans(log):
            rows = np.flatnonzero(numbers == phase)
            if phase in (Phase.DONE, Phase.FAILED) or len(rows) == 0:
                continue
            kept = rows[path_rows(platform[rows])]
            look = nth_look(int(phase))
            one.plot(
                1e3 * platform[kept, across], 1e3 * platform[kept, up], label=phase.word,
                marker=look.marker, markevery=max(1, len(kept) // 4), **line_style(look),
            )  # fmt: skip
        dark = np.flatnonzero(hidden)
        if len(dark):
            one.plot(
                1e3 * platform[dark, across], 1e3 * platform[dark, up], color=LOST.color,
                linewidth=7.0, alpha=0.35, zorder=0, label="tag hidden",
            )  # fmt: skip
        kept = path_rows(box)
        one.plot(
            1e3 * box[kept, across], 1e3 * box[kept, up], label="box", linewidth=1.0,
            **line_style(TARGET),
        )  # fmt: skip
        goal = 1e3 * built.X_WG.translation()
        one.plot(goal[across], goal[up], "k+", markersize=14, label="goal")
        one.set(xlabel="x in W [mm]", ylabel=f"{'xyz'[up]} in W [mm]", aspect="equal")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure


def write_pick_and_place_data(folder: Path, run: PickAndPlaceRun) -> dict[str, Any]:
    """Writes log, inputs and summary of a run into an existing folder; returns the summary."""
    summary = summarize_pick_and_place(run)
    write_log(folder, run.log, *placed_log_names(run))
    write_run_inputs(folder, run.scenario, run.built.robot)
    write_json(folder / "summary.json", summary)
    return summary


def placed_log_names(run: PickAndPlaceRun) -> LogNames:
    """Names for the log's columns."""
    return [cable.name for cable in run.built.robot.cables], (), None


def pick_and_place_pictures(
    run: PickAndPlaceRun, formats: Sequence[str] = DEFAULT_FORMATS
) -> Pictures:
    """What draws figures and replay of a run, by the names of their files."""
    robot, log, scenario = run.built.robot, run.log, run.scenario
    drawn = {
        "phases": lambda: phase_figure(run),
        "way": lambda: way_figure(run),
        "tensions": lambda: cable_figure(
            _title(run, "Tensions of the cables"), robot, log, "tensions", "tension [N]",
            bounds=robot.tension_limits(),
        ),
    }  # fmt: skip
    pictures: Pictures = dict(figure_writers(drawn, formats))
    pictures["replay.html"] = lambda path: write_replay(
        path, robot, log, cables=scenario.cables, title=scenario.title,
        around=Surroundings(scenario.world, tuple(shown_things(scenario))),
    )  # fmt: skip
    return pictures
