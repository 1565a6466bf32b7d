"""Study: does a servo converge from every pose of its control stability workspace?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import (
    NOT_TESTABLE,
    Statement,
    evaluate_checks,
    statement_table,
    verdict,
)
from cdpr_drake.analyses.studies.closed_loops.figures import error_figure, way_figure
from cdpr_drake.analyses.studies.closed_loops.loops import (
    COLUMNS,
    MANAGED,
    MANAGEMENT,
    MODES,
    PLAIN,
    TILT_DEG,
    YAW_DEG,
    ClosedLoopTask,
    Starts,
    desired_platform,
    stable_starts,
)
from cdpr_drake.analyses.studies.closed_loops.servo_models import Perturbation, perturbed_servo
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.sweeps.folder import store_arrays
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import vector_size
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.workspaces.static_feasibility import statically_feasible

ROBOT = "acrobot_large"
VERDICT = "searched"
STARTS, QUICK_STARTS = 200, 2
SEED = 1

SETTINGS = (
    f"robot={ROBOT}",
    "camera.kind=projected",
    "camera.pixel_noise=0",
    "target.pose.position=[0, 0, 0]",
    "desired.position=[0, 0, 0.3]",
    "duration=60",
)
"""What differs from the scenario acrobot_pbvs: the tag lies in the middle of the floor, so that it
is seen from much of the workspace, and images have no noise, so that perturbations are all."""

COMMON = ("scenario", "case", "bounds", "verdict", "options", "seed", "starts")
"""What the tasks of all modes have in common."""

LOWEST = 0.15
"""Starts keep this height, so that the tag is in front of the camera [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoopStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        scheme: Visual servoing scheme.
        scenario: The task.
        case: The same for the verdict.
        bounds: What limited the perturbations, for JSON.
        starts: Where the loops began.
        runs: Numbers of the runs by finished mode, shape (n, len(COLUMNS)).
        curves: |e| over the runs by mode, shape (n, k).
        ways: Poses on the path by mode, shape (n, k, 7).
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    scheme: str
    scenario: Scenario
    case: StabilityCase
    bounds: dict[str, Any]
    starts: Starts
    runs: dict[str, Array]
    curves: dict[str, Array]
    ways: dict[str, Array]
    progress: WorkProgress

    def column(self, mode: str, name: str) -> Array:
        """One number of all runs, shape (n,)."""
        return np.asarray(self.runs[mode][:, COLUMNS.index(name)])

    def summary(self, mode: str) -> dict[str, Any]:
        """Counts and extremes of one mode, and the runs that did not converge."""
        outcomes = self.column(mode, "outcome").astype(int)
        good = outcomes == Outcome.CONVERGED
        inside = self.column(mode, "poses_outside_z") == 0.0
        lost = outcomes == Outcome.TARGET_LOST
        return {
            "mode": mode,
            "runs": len(outcomes),
            "converged": int(np.sum(good)),
            "target_lost": int(np.sum(lost)),
            "otherwise": int(np.sum(~good & ~lost)),
            "ways_inside_z": int(np.sum(inside)),
            "ways_inside_z_converged": int(np.sum(inside & good)),
            "poses_checked": int(np.sum(self.column(mode, "poses_checked"))),
            "poses_outside_z": int(np.sum(self.column(mode, "poses_outside_z"))),
            "least_margin": float(np.min(self.column(mode, "least_margin"))),
            "largest_error_growth": float(np.max(self.column(mode, "error_growth"))),
            "largest_error_peak": float(np.max(self.column(mode, "error_peak"))),
            "largest_estimate_error_m": float(np.max(self.column(mode, "estimate_error_m"))),
            "largest_estimate_error_rad": float(np.max(self.column(mode, "estimate_error_rad"))),
            "largest_position_error_m": float(
                np.max(self.column(mode, "position_error_m")[good], initial=0.0)
            ),
            "not_converged": [
                {
                    "start": int(number),
                    "outcome": Outcome(outcomes[number]).name.lower(),
                    "pose_qw_qx_qy_qz_x_y_z": self.starts.poses[number].tolist(),
                    **dict(zip(COLUMNS[1:], self.runs[mode][number, 1:].tolist(), strict=True)),
                }
                for number in np.flatnonzero(~good)
            ],
        }

    @property
    def statements(self) -> list[Statement]:
        """What the criterion promises, judged."""
        return evaluate_checks(CHECKS, self)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, starts, summaries, statements."""
        s = self.starts
        return {
            "study": "stability-closed-loop",
            "interrupted": self.interrupted,
            "loops": self.progress.counts("closed"),
            "wall_time_s": self.progress.wall_time,
            "robot": ROBOT,
            "scheme": self.scheme,
            "verdict": VERDICT,
            "seed": SEED,
            "bounds": self.bounds,
            "settings": list(SETTINGS),
            "loop": choose_compiled_loop(self.scenario).integration.loop,
            "case": plain(self.case),
            "versions": package_versions(),
            "starts": {
                "count": len(s.poses),
                "drawn": s.drawn,
                "not_held": s.not_held,
                "not_seen": s.not_seen,
                "not_stable": s.not_stable,
                "largest_tilt_deg": TILT_DEG,
                "largest_yaw_deg": YAW_DEG,
            },
            "modes": MODES,
            "runs": [self.summary(mode) for mode in self.runs],
            "statements": [statement.as_dict() for statement in self.statements],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = Table(
            title=f"{ROBOT}, {self.scheme}: loops from {len(self.starts.poses)} poses of SZ"
        )
        for heading in (
            "loop", "converged", "tag left image", "otherwise", "ways inside Z", "least margin",
            "largest |e| / |e| at start", "estimate off by",
        ):  # fmt: skip
            table.add_column(heading)
        lost = Table(title="Not converged")
        for heading in (
            "loop", "start", "outcome", "x, y, z [m]", "time [s]", "way outside Z", "taut cables",
        ):  # fmt: skip
            lost.add_column(heading)
        for mode in self.runs:
            s = self.summary(mode)
            table.add_row(
                mode,
                f"{s['converged']} of {s['runs']}",
                str(s["target_lost"]),
                str(s["otherwise"]),
                f"{s['ways_inside_z']} ({s['ways_inside_z_converged']} conv.)",
                f"{s['least_margin']:.3f}",
                f"{s['largest_error_peak']:.2f}",
                f"{1e3 * s['largest_estimate_error_m']:.1f} mm, "
                f"{np.degrees(s['largest_estimate_error_rad']):.2f} deg",
            )
            for run in s["not_converged"]:
                place = ", ".join(f"{v:.2f}" for v in run["pose_qw_qx_qy_qz_x_y_z"][4:])
                lost.add_row(
                    mode, str(run["start"]), run["outcome"], place, f"{run['time_s']:.1f}",
                    f"{run['poses_outside_z']:.0f} of {run['poses_checked']:.0f} poses",
                    f"{run['taut_at_end']:.0f} of {self.case.m} at the end",
                )  # fmt: skip
        tables = [table, lost] if lost.row_count else [table]
        if self.statements:
            tables.append(statement_table("What the criterion promises", self.statements))
        return tables

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """As `DrawnStudy.write`, and `runs.npz` before."""
        arrays: dict[str, Any] = {"starts": self.starts.poses, "columns": np.array(COLUMNS)}
        for mode in self.runs:
            arrays |= {
                f"{mode}: runs": self.runs[mode],
                f"{mode}: curves": self.curves[mode],
                f"{mode}: ways": self.ways[mode],
            }
        store_arrays(folder / "runs.npz", arrays)
        return super().write(folder, formats)

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """Errors of all loops, and their paths."""
        if not self.runs:
            return {}
        return {
            "errors": partial(error_figure, self.curves, self.runs),
            "ways": partial(way_figure, self.ways, self.runs),
        }


def reached(found: ClosedLoopStudy) -> Statement:
    """(3.27), of loops whose way stays inside, and of all."""
    found_modes = {mode: found.summary(mode) for mode in found.runs}
    found_modes.pop(MANAGED, None)  # the criterion takes every cable as taut
    if not found_modes:
        raise KeyError("no mode is finished")
    inside = [s["ways_inside_z"] == s["ways_inside_z_converged"] for s in found_modes.values()]
    every = [s["runs"] == s["converged"] for s in found_modes.values()]
    return Statement(
        f"From any pose of the control stability workspace the servo reaches its goal ({ROBOT}, "
        f"{found.scheme}).",
        "(3.27), 3.4",
        "; ".join(
            f"{mode}: {s['converged']} of {s['runs']} converge, of those whose way stays inside "
            f"{s['ways_inside_z_converged']} of {s['ways_inside_z']}"
            for mode, s in found_modes.items()
        ),
        verdict(all(every), all(inside)),
        "The criterion says nothing of the tag's leaving the image, nor of ways that leave the "
        "workspace; in part: all whose way stays inside converge.",
    )


def managed(found: ClosedLoopStudy) -> Statement:
    """5.1: what ends with slack cables without tension management, and how it ends with it."""
    plain_ends, ends = (found.column(mode, "outcome") for mode in (PLAIN, MANAGED))
    taut = found.column(PLAIN, "taut_at_end")
    good, arrived = plain_ends == Outcome.CONVERGED, ends == Outcome.CONVERGED
    hung = np.flatnonzero(~good & (taut < found.case.m))
    places = "; ".join(
        f"start {k} at ({', '.join(f'{x:.2f}' for x in found.starts.poses[k, 4:])}) m on "
        f"{taut[k]:.0f} cables, with it {Outcome(int(ends[k])).name.lower()}"
        for k in hung[:5]
    )
    counts = (
        f"{np.sum(good)} and {np.sum(arrived)} of {len(ends)} converge without and with it, "
        f"{np.sum(good & ~arrived)} without it alone"
    )
    return Statement(
        "Loops that end elsewhere, on slack cables, reach their goal when tensions are managed "
        f"({ROBOT}, {found.scheme}).",
        "5.1, 5.2.1",
        f"{places or 'no loop ends so'}; {counts}",
        verdict(bool(all(arrived[hung])), bool(any(arrived[hung]))) if len(hung) else NOT_TESTABLE,
        "Worst errors that a search finds, a constantly wrong estimate; 1 N, 0.003 m/(N s).",
    )


CHECKS = (reached, managed)
"""Of the criterion, and of what it leaves out."""


def study_closed_loop(
    quick: bool = False,
    session: StudySession = DEFAULT_STUDY_SESSION,
    scheme: str = "pbvs",
) -> ClosedLoopStudy:
    """Runs the study.

    Args:
        quick: Few runs, to see that everything works.
        session: How it is run.
        scheme: Visual servoing scheme.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.

    Source: servoing thesis (3.27): from any pose of the workspace the servo shall reach its goal.
    """
    count = QUICK_STARTS if quick else STARTS
    scenario = load_scenario("acrobot_pbvs", [*SETTINGS, f"controller.scheme={scheme}"])
    robot = load_robot(ROBOT)
    defaults = workspace_defaults(robot, ROBOT)
    bounds, options = defaults.bounds, VerdictOptions(seed=SEED)
    none = Perturbation.from_vector(np.zeros(vector_size(len(robot.cables))))
    servo = perturbed_servo(scenario, none)
    case = StabilityCase(
        robot.cable_set().without_pulleys(),
        scheme,
        X_PC=servo.X_PC,
        target=FixedObject(servo.X_WO, scenario.desired.transform()),
        lever="object",
    )
    statics = static_case(robot)
    goal = desired_platform(servo)
    held = statically_feasible(statics, goal.translation()[None], goal.rotation().matrix()[None])
    if not (
        held[0] and judge_stability(case, bounds, pose_row(goal)[None], VERDICT, options).stable[0]
    ):
        raise StabilityError("closed loop: the desired pose is not stable, or cannot be held")

    session.tell(WorkProgress("drawing starts", 0, len(MODES) * count, 0.0, rate="loops/s"))
    lower = np.maximum(defaults.lower, [-np.inf, -np.inf, LOWEST])
    starts = stable_starts(
        servo,
        case,
        statics,
        bounds,
        box=(lower, defaults.upper),
        count=count,
        verdict=VERDICT,
        options=options,
        seed=SEED,
    )
    with_management = load_scenario(
        "acrobot_pbvs", [*SETTINGS, MANAGEMENT, f"controller.scheme={scheme}"]
    )
    tasks = {
        mode: (
            ClosedLoopTask(
                scenario=with_management if mode == MANAGED else scenario,
                case=case,
                bounds=bounds,
                starts=starts.poses,
                verdict=VERDICT,
                options=options,
                loop=mode.partition(",")[0],
                seed=SEED,
                worst="worst" in mode,
            ),
            count,
        )
        for mode in MODES
    }
    result = run_study_sweep(tasks, max(1, count // 50), "loops", _arguments(tasks, quick), session)
    return ClosedLoopStudy(
        scheme=scheme,
        scenario=scenario,
        case=case,
        bounds=bounds.as_dict(),
        starts=starts,
        runs={mode: part["runs"] for mode, part in result.finished.items()},
        curves={mode: part["curve"] for mode, part in result.finished.items()},
        ways={mode: part["way"] for mode, part in result.finished.items()},
        progress=result.progress,
    )


def _arguments(tasks: Mapping[str, tuple[ClosedLoopTask, int]], quick: bool) -> dict[str, Any]:
    """All that the numbers depend on, for JSON; the starts belong to it, drawn anew each time."""
    task, _ = next(iter(tasks.values()))
    return {
        "cdpr_drake": code_version(),
        "study": "stability-closed-loop",
        "quick": quick,
        "modes": list(tasks),
        "management": MANAGEMENT,
        **{name: plain(getattr(task, name)) for name in COMMON},
    }
