"""Study: a box is taken and set down by what cameras see, with its goal in view and hidden.

`study_pick_and_place` runs `acrobot_pick_and_place` over seeds, which say where box and goal truly
are and what the robot believes wrongly: with the goal's tag in view, hidden on the way, hidden
while the box is lowered, and with the camera alone that the box blinds.

`HandlingTrial` gives one run as numbers, an item of a sweep. `CHECKS` say what picking and placing
has to show, and whether it does. `PickAndPlaceStudy` is what the study leaves: numbers, tables,
figures.

Source: servoing thesis 5.4, perspectives; the numbers that have to be reached are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, verdict
from cdpr_drake.analyses.simulation.pick_and_place_run import PickAndPlaceRun, run_pick_and_place
from cdpr_drake.analyses.simulation.pick_and_place_summary import unseen
from cdpr_drake.analyses.studies.framework.seeded_study import SeededStudy, StudyData
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.palette import BOUND, look_of
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import FAILURE_WORDS, Failure, Phase

SCENARIO = "acrobot_pick_and_place"

HIDDEN = 3.0
"""Time for which the tag is hidden [s]."""

CONDITIONS: dict[str, tuple[str, ...]] = {
    "in view": ("cover=null",),
    "hidden while carried": (f"cover={{phase: carry, delay: 0.5, duration: {HIDDEN}}}",),
    "hidden while lowered": (f"cover={{phase: lower, delay: 0.5, duration: {HIDDEN}}}",),
    "one camera": ("goal_camera=null",),
}
"""What is changed in the scenario, by what the camera sees of the goal's tag on the way."""

CLEAR, ON_THE_WAY, LOWERED, ONE_CAMERA = CONDITIONS

COLUMNS = (
    "outcome",
    "failed_in",
    "failure",
    "distance_m",
    "angle_rad",
    "offset_x_m",
    "offset_y_m",
    "offset_z_m",
    "time_s",
    "losses",
    "unseen_s",
    "hidden_s",
    "dead_reckoning_m",
)
"""Numbers of a run: how it ended, in which phase and why it failed, how far the box is from the
goal and where from there, how long it took, views that were lost, time without the tag that was
needed, time for which a tag was hidden, and the largest error of dead reckoning after the start."""


@dataclass(frozen=True)
class HandlingTrial:
    """Runs of one condition; the seed is the number of the run.

    Attributes:
        condition: One of `CONDITIONS`.
        camera: Kind of the cameras.
        overrides: What else is changed in the scenario.
    """

    condition: str
    camera: str
    overrides: tuple[str, ...] = ()

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Rows of `COLUMNS` for the seeds start to stop."""
        return {"runs": np.array([self.row(seed) for seed in range(start, stop)])}

    def row(self, seed: int) -> Array:
        """`COLUMNS` of one run."""
        settings = [*CONDITIONS[self.condition], f"camera.kind={self.camera}", f"seed={seed}"]
        return row_of(run_pick_and_place(load_scenario(SCENARIO, [*settings, *self.overrides])))


def row_of(run: PickAndPlaceRun) -> Array:
    """`COLUMNS` of a run."""
    log, goal = run.log, run.built.X_WG
    times, X_WB = np.asarray(log["time"]), pose_from_row(log["X_WB"][-1])
    distance, angle = pose_error(goal, X_WB)
    drift = np.linalg.norm(
        np.asarray(log["X_WP"])[:, 4:] - np.asarray(log["X_WP_estimated"])[:, 4:], axis=1
    )
    hidden = np.asarray(log["hidden"]) if "hidden" in log else np.zeros(1)
    state = run.state
    assert state is not None  # it was simulated here
    return np.array([
        run.outcome, state.failed_in, state.failure, distance, angle,
        *(goal.inverse() @ X_WB).translation(), run.sim_time, state.losses,
        np.mean(unseen(log)) * times[-1], np.mean(hidden) * times[-1], np.max(drift),
    ], float)  # fmt: skip


def column(runs: Array, name: str) -> Array:
    """One of `COLUMNS` of runs, shape (n,)."""
    return np.asarray(runs[:, COLUMNS.index(name)])


def placed(runs: Array) -> np.ndarray:
    """Which runs set the box down, shape (n,), bool."""
    return np.asarray(column(runs, "outcome") == Outcome.COMPLETED)


def failed_phase(row: Array) -> str:
    """The phase in which a run failed, in words."""
    return Phase(int(row[COLUMNS.index("failed_in")])).word


DISTANCE, ANGLE = 2e-3, float(np.radians(1.0))
"""Within which the box is set down [m, rad]."""


def within(runs: Array) -> np.ndarray:
    """Which runs set the box down within `DISTANCE` and `ANGLE`, shape (n,), bool."""
    near = (column(runs, "distance_m") <= DISTANCE) & (column(runs, "angle_rad") <= ANGLE)
    return np.asarray(placed(runs) & near)


def result_words(runs: Array) -> str:
    """How many runs set the box down as they should, and how far off at most."""
    good, done = within(runs), placed(runs)
    words = f"{int(np.sum(good))} of {len(runs)}"
    if np.any(done):
        distance = 1e3 * float(np.max(column(runs, "distance_m")[done]))
        angle = float(np.degrees(np.max(column(runs, "angle_rad")[done])))
        words += f"; largest {distance:.2f} mm, {angle:.2f} deg"
    failures = sorted({_failure_words(row) for row in runs[~done]})
    return "; ".join([words, *failures])


def _failure_words(row: Array) -> str:
    failure = Failure(int(row[COLUMNS.index("failure")]))
    return f"{failed_phase(row)}: {FAILURE_WORDS.get(failure, 'not ended')}"


def _set_down(runs: Array, words: str, printed: str) -> Statement:
    good = within(runs)
    return Statement(
        words, printed.format(len(runs)), result_words(runs),
        verdict(bool(np.all(good)), bool(np.any(good))),
    )  # fmt: skip


def set_down(found: StudyData) -> Statement:
    """The box is set down within 2 mm and 1 deg."""
    words = "a box is taken, carried and set down by what two cameras see, within 2 mm and 1 deg"
    return _set_down(found[CLEAR]["runs"], words, "{0} of {0} seeds")


def hidden_on_the_way(found: StudyData) -> Statement:
    """The same with the goal's tag hidden for 3 s on the way."""
    runs = found[ON_THE_WAY]["runs"]
    words = f"the same with the goal's tag hidden for {HIDDEN:g} s while the box is carried"
    return _set_down(runs, words, "{0} of {0} seeds")


def hidden_while_lowered(found: StudyData) -> Statement:
    """The same with the goal's tag hidden for 3 s while the box is lowered."""
    runs = found[LOWERED]["runs"]
    words = f"the same with the goal's tag hidden for {HIDDEN:g} s while the box is lowered"
    return _set_down(runs, words, "{0} of {0} seeds")


def one_camera_fails(found: StudyData) -> Statement:
    """With one camera, which the box blinds, no run comes to an end, and says so."""
    runs = found[ONE_CAMERA]["runs"]
    told = column(runs, "failure") == Failure.TAG_NOT_SEEN
    return Statement(
        "the box occludes the field of view of the camera that saw it, so that with this camera "
        "alone its placing is not accurate: several cameras, or a pan-tilt one, are needed",
        "the goal is not seen",
        f"{int(np.sum(placed(runs)))} of {len(runs)} set the box down; "
        f"{int(np.sum(told))} ended because the goal's tag was not seen",
        verdict(bool(np.all(told)), bool(np.any(told))),
        "the view past the box's sides does not reach the goal's tag",
    )


CHECKS = (set_down, hidden_on_the_way, hidden_while_lowered, one_camera_fails)

SEEDS, QUICK_SEEDS = 20, 1
ONE_CAMERA_SEEDS = 5
"""Runs with one camera, which all end the same way."""


@dataclass(frozen=True, eq=False)
class PickAndPlaceStudy(SeededStudy):
    """What the study found; `seeds` are runs of each condition with two cameras."""

    name = "pick-and-place"
    judges = CHECKS
    stated = "Pick and place"

    @property
    def camera(self) -> str:
        """Kind of the cameras: projected in the quick form."""
        return PROJECTED if self.quick else RENDERED

    def about(self) -> dict[str, Any]:
        """What comes first in `as_dict`."""
        return {**super().about(), "camera": self.camera}

    def details(self) -> dict[str, Any]:
        """Arguments, versions, runs."""
        return {
            "items": self.progress.counts(),
            "versions": package_versions(),
            "seeds": self.seeds,
            "conditions": {name: list(CONDITIONS[name]) for name in self.found},
            "within": {"distance_m": DISTANCE, "angle_rad": ANGLE},
            **self.runs_dict(COLUMNS),
        }

    def number_tables(self) -> list[Table]:
        """Box against goal, by condition."""
        table = new_table(
            f"Picking and placing, {self.camera} cameras: box against goal",
            ("the goal's tag",),
            ("within", "median [mm]", "largest [mm]", "largest [deg]", "time [s]", "unseen [s]"),
        )
        for name, arrays in self.found.items():
            runs = arrays["runs"]
            done = runs[placed(runs)]
            cells = ["-"] * 3
            if len(done):
                distance, angle = column(done, "distance_m"), column(done, "angle_rad")
                cells = [
                    f"{1e3 * np.median(distance):.3f}", f"{1e3 * np.max(distance):.3f}",
                    f"{np.degrees(np.max(angle)):.3f}",
                ]  # fmt: skip
            table.add_row(
                name, f"{int(np.sum(within(runs)))} of {len(runs)}", *cells,
                f"{np.mean(column(runs, 'time_s')):.1f}",
                f"{np.mean(column(runs, 'unseen_s')):.1f}",
            )  # fmt: skip
        return [table]

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """The figure `set_down`."""
        return {"set_down": partial(set_down_figure, self)} if self.found else {}


def set_down_figure(study: PickAndPlaceStudy) -> Figure:
    """Errors of the box over seeds, and where it lies beside the goal."""
    title = f"Where the box is set down, {study.camera} cameras"
    figure, axes = new_figure(1, 3, (15.0, 5.2), title)
    for name, arrays in study.found.items():
        runs, look = arrays["runs"], look_of(name, tuple(CONDITIONS))
        seeds, done = np.arange(len(runs)), placed(runs)
        dots = {"linestyle": "none", "marker": look.marker, "color": look.color}
        label = f"{name}: {result_words(runs).partition(';')[0]}"
        axes[0].plot(seeds[done], 1e3 * column(runs, "distance_m")[done], label=label, **dots)
        axes[1].plot(seeds[done], np.degrees(column(runs, "angle_rad")[done]), **dots)
        axes[2].plot(
            1e3 * column(runs, "offset_x_m")[done], 1e3 * column(runs, "offset_y_m")[done], **dots
        )
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    reach = 1e3 * DISTANCE
    axes[0].axhline(reach, label="accepted", **line_style(BOUND))
    axes[1].axhline(float(np.degrees(ANGLE)), **line_style(BOUND))
    axes[2].plot(reach * np.cos(turn), reach * np.sin(turn), **line_style(BOUND))
    axes[0].set(xlabel="seed", ylabel="distance from the goal [mm]", ylim=(0.0, None))
    axes[1].set(xlabel="seed", ylabel="angle from the goal [deg]", ylim=(0.0, None))
    axes[2].set(xlabel="x in G [mm]", ylabel="y in G [mm]", aspect="equal")
    for one in axes[:2]:
        one.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def study_pick_and_place(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> PickAndPlaceStudy:
    """Runs the study; each run is an item of a sweep.

    Args:
        quick: One seed of each condition, by projected cameras.
        session: How it is run, and over how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        RenderingError: EGL is missing.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    camera = PROJECTED if quick else RENDERED
    tasks: dict[str, tuple[SweepTask, int]] = {
        name: (
            HandlingTrial(name, camera),
            min(seeds, ONE_CAMERA_SEEDS) if name == ONE_CAMERA else seeds,
        )
        for name in CONDITIONS
    }
    return PickAndPlaceStudy.run(tasks, quick, seeds, session)
