"""Studies of a visual servo: configurations of a scenario, repeated with seeds.

A row has the outcome of a run, numbers of its path, and its curves as arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.stability import stability_along
from cdpr_drake.analyses.studies.facts import FACTORS, MissingRuns
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, unit_of
from cdpr_drake.arrays import Array
from cdpr_drake.models.rendered_camera import probe_rendering
from cdpr_drake.models.robot_loader import load_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop

Curves = Mapping[str, Array]

Numbers = Callable[[Curves], Mapping[str, Any]]
"""Gives a study's own columns of a run's curves, in SI units."""

PULLEYS = "cables.pulleys=true"
"""The simulated robot has the pulleys of the prototype; the controller knows nothing of them."""

CAROCA_RUN = (PULLEYS, "duration=150")
"""Runs of CAROCA end when the servo has converged; one that has not within the 90 s of its scenario
has not yet failed."""

CAROCA_ASSUMPTION = (
    "CAROCA's cables are catenaries over pulleys, of the printed modulus and diameter and of the "
    "weight of solid steel, as A.1.2 asks for; the platform's swing is damped by what its robot "
    "file says. That damping is fitted so that a gain of 1.5 1/s converges (servoing thesis 2.3), "
    "and 1.7 1/s is at the limit (4.4.2); nothing else is. All cases on CAROCA have these cables."
)
"""See docs/theory/reproduction.md, "The cables of CAROCA"."""

METRICS = (
    "time_s", "position_error_m", "rotation_error_rad", "image_max_px", "image_mean_px",
    "camera_max_m", "camera_mean_m", "estimate_max_m", "estimate_max_rad", "estimate_jump_m",
)  # fmt: skip
"""Numbers of every run: time; true error at the end; largest and mean distance of the object's
centre from its straight line in an image 1600 px wide, and of the camera's origin from its own;
largest error of the platform's estimate, and its largest change between two rows of the log beside
that of the true pose."""

IN_TABLES = {"m": "mm", "rad": "deg", "m/s": "mm/s"}
"""Units in which tables have columns, by those of the columns; shares are in %."""

MOMENTS = {
    "position_error_m": "end", "rotation_error_rad": "end", "image_max_px": "largest",
    "image_mean_px": "mean", "camera_max_m": "largest", "camera_mean_m": "mean",
    "estimate_max_m": "largest", "estimate_max_rad": "largest",
    "estimate_end_m": "end", "estimate_end_rad": "end",
    "estimate_mean_m": "mean", "estimate_mean_rad": "mean",
}  # fmt: skip
"""Which number of a curve columns are; a printed number has to be of the same."""

LEFT_OUT = ("wall_time_s", "realtime_factor", "versions")
"""What of a run's summary is another in each session, or the same for the whole study."""

LOGGED = (
    "lengths", "unstrained_lengths", "slack", "measured_tensions", "X_WP", "tension_corrections",
    "tension_thresholds",
)  # fmt: skip
"""Columns of the log that curves have where the criterion of stability is followed."""


@dataclass(frozen=True)
class Configuration:
    """One configuration of a servo.

    Attributes:
        name: Once in a study.
        label: Words for legends and tables.
        changes: Items "key.subkey=value" that change the scenario.
        group: Experiment, which has tables and figures of its own.
        scenario: Scenario in the place of the study's.
        repetitions: Runs in the place of the study's number.
        platform: Arrays of the section `platform` that replace those of the robot's file.
    """

    name: str
    label: str
    changes: tuple[str, ...] = ()
    group: str = ""
    scenario: str = ""
    repetitions: int = 0
    platform: Mapping[str, Any] = field(default_factory=dict)


def servo_cases(
    form: Form, scenario: str, configurations: Sequence[Configuration], *,
    changes: Sequence[str] = (), rendered: Sequence[str] = (), quick: Sequence[str] = (),
    metrics: Numbers | None = None, stability: float | None = None,
    repetitions: int = 5,
) -> Iterator[Case]:  # fmt: skip
    """Cases of configurations, rendered ones first, which take longest.

    Args:
        form: In the quick form nothing is rendered.
        scenario: What the configurations change.
        configurations: In the order of the source.
        changes: What all of them share.
        rendered: Names of those that also run once with rendered images.
        quick: Names of those of the quick form; empty: all.
        metrics: Gives the study's own columns.
        stability: Tension from which a cable counts in the criterion of stability [N]; None: the
            criterion is not followed.
        repetitions: Runs of each.
    """
    chosen = [c for c in configurations if not (form.quick and quick) or c.name in quick]
    images = [] if form.quick else [c for c in chosen if c.name in rendered]
    if images:
        probe_rendering()
    for camera, some in ((RENDERED, images), (PROJECTED, chosen)):
        for c in some:
            call = partial(
                servo_run, c.scenario or scenario, (*changes, *c.changes, f"camera.kind={camera}"),
                metrics, stability,
            )  # fmt: skip
            if c.platform:
                call = partial(call, platform=c.platform)
            most = 1 if camera == RENDERED else None
            keys = {"configuration": c.name, "group": c.group, "camera": camera}
            yield Case(
                keys=keys, call=call, seeds=form.times(c.repetitions or repetitions, most=most)
            )


def servo_run(
    scenario: str, changes: Sequence[str], metrics: Numbers | None, stability: float | None,
    seed: int, platform: Mapping[str, Any] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Runs a configuration, by the compiled loop where that can do it, which the summary says.

    Returns:
        outcome, message; `METRICS` and the study's own, None where there is none; summary, as
        `cdpr simulate` writes it; features, names of the components of "error"; stop_position_m,
        the measured distance at which a run counts as converged; the arrays of
        `ServoRun.traces`, and of `stability_curves`.
    """
    items = [*changes, f"seed={seed}"]
    loaded = load_scenario(scenario, items)
    robot: Robot | str = loaded.robot
    if platform:
        arrays: dict[str, Any] = {key: np.asarray(value) for key, value in platform.items()}
        robot = load_robot(loaded.robot)
        robot.platform = replace(robot.platform, **arrays)
    with robot_reference(robot) as name:
        loaded = load_scenario(scenario, [*items, f"robot={name}"])
        result = ServoRun(choose_compiled_loop(loaded)).simulate()
    curves = result.traces()
    if stability is not None:
        curves |= stability_curves(result, stability)
    summary = result.as_dict()
    image, camera = summary["image_deviation_px_1600x1200"], summary["camera_deviation_m"]
    return {
        "outcome": summary["outcome"], "message": result.message,
        "time_s": summary["sim_time_s"], "position_error_m": summary["final_position_error_m"],
        "rotation_error_rad": summary["final_rotation_error_rad"],
        "image_max_px": image["max"], "image_mean_px": image["mean"],
        "camera_max_m": camera["max"], "camera_mean_m": camera["mean"],
        "estimate_max_m": float(np.max(curves["estimate_distance"])),
        "estimate_max_rad": float(np.max(curves["estimate_angle"])),
        "estimate_jump_m": estimate_jump(curves),
        **({} if metrics is None else metrics(curves)),
        "summary": {name: value for name, value in summary.items() if name not in LEFT_OUT},
        "features": list(result.built.feature_names),
        "stop_position_m": result.built.scenario.stop.position,
        **curves,
    }  # fmt: skip


def estimate_jump(curves: Curves) -> float:
    """Largest change of the estimate's error vector between two rows of the log [m]."""
    error = curves["estimate_path"] - curves["platform_path"]
    if len(error) < 2:
        return 0.0
    return float(np.max(np.linalg.norm(np.diff(error, axis=0), axis=1)))


def stability_curves(result: ServoRun, threshold: float) -> dict[str, Array]:
    """The criterion along a run, cables below a tension `threshold` [N] left out.

    Returns:
        stability_time [s], taut_cables, jacobian_rank, stability_margin (k,) [-]; `LOGGED`, shape
        (n, ...), where they are logged.
    """
    along, log = stability_along(result, threshold), result.log
    return {
        "stability_time": along.time, "taut_cables": along.taut, "jacobian_rank": along.rank,
        "stability_margin": along.margin, **{name: log[name] for name in LOGGED if name in log},
    }  # fmt: skip


def projected(rows: Frame) -> Frame:
    """Rows with projected images, of which facts, figures and tables are."""
    return rows[rows["camera"] == PROJECTED]


def _of_projected(make: Callable[[Frame], Any], rows: Frame) -> Any:
    return make(projected(rows))


def outcome_words(outcomes: Iterable[str]) -> str:
    """Words such as `3 converged, 2 target_lost`."""
    found = list(outcomes)
    return ", ".join(f"{found.count(one)} {one}" for one in dict.fromkeys(found))


def table(
    rows: Frame, camera: str, group: str, labels: Mapping[str, str], columns: Sequence[str]
) -> Frame:
    """Means over the runs of each configuration of an experiment.

    Raises:
        MissingRuns: None of it was run.
    """
    mine = rows[(rows["camera"] == camera) & (rows["group"] == group)]
    if not len(mine):
        raise MissingRuns(group)
    groups = mine.groupby("configuration", sort=False)
    found = groups["outcome"].agg(outcome_words).to_frame()
    for column in columns:
        unit = "%" if column.endswith("_share") else unit_of(column)
        unit = IN_TABLES.get(unit, unit)
        means = groups[column].agg(lambda values: np.mean(np.asarray(values, float)))
        heading = (
            f"{column.rpartition('_')[0].replace('_', ' ') if unit else column} [{unit or '-'}]"
        )
        found[heading] = FACTORS.get(unit, 1.0) * means
    return found.reset_index().assign(
        configuration=lambda frame: frame["configuration"].map(labels)
    )


def accuracy(rows: Frame) -> dict[str, Any]:
    """Accuracy and repeatability of the camera's last place by configuration.

    Returns:
        accuracy_m, distance of the mean place from the mean goal; repeatability_m, largest distance
        from the mean place.

    Source: servoing thesis, figure 2.13.
    """
    found = {}
    for name, mine in projected(rows).groupby("configuration", sort=False):
        ends = np.array([arrays["camera_path"][-1] for arrays in mine["arrays"]])
        goal = np.mean([arrays["camera_line"][-1] for arrays in mine["arrays"]], axis=0)
        middle = ends.mean(axis=0)
        found[name] = {
            "accuracy_m": float(np.linalg.norm(middle - goal)),
            "repeatability_m": float(np.max(np.linalg.norm(ends - middle, axis=1))),
        }
    return found


def servo_study(
    *, name: str, title: str, source: str, scenario: str, configurations: Sequence[Configuration],
    assumptions: Sequence[str] = (), columns: Sequence[str] = (),
    figures: Mapping[str, Any] | None = None, finds: Mapping[str, Any] | None = None,
    tables: Mapping[str, Any] | None = None, laps: Mapping[str, float] | None = None, **how: Any,
) -> Study:  # fmt: skip
    """A study whose cases are configurations of a scenario.

    Args:
        name, title, source, assumptions, finds, tables: As of `Study`.
        scenario, configurations, how: As of `servo_cases`.
        columns: The study's own numbers that tables have.
        figures: Its own, beside those of each experiment; these see projected images alone.
        laps: Time of a lap of experiments behind an object that runs in laps [s].
    """
    from cdpr_drake.analyses.studies.servo_figures import group_figures

    labels = {c.name: c.label for c in configurations}
    groups: dict[str, dict[str, str]] = {}
    for c in configurations:
        groups.setdefault(c.group, {})[c.name] = c.label
    drawn = {
        **group_figures(f"{title} ({name})", groups, "stability" in how, laps or {}),
        **(figures or {}),
    }
    cameras = {PROJECTED: "projected camera", RENDERED: "rendered images, one run each"}
    return Study(
        name=name,
        title=title,
        source=source,
        assumptions=assumptions,
        finds=finds or {},
        cases=partial(servo_cases, scenario=scenario, configurations=configurations, **how),
        parameters=lambda form: {
            "scenario": scenario,
            "changes": how.get("changes", ()),
            "stability": how.get("stability"),
        },
        numbers=accuracy,
        compared=projected,
        moments=MOMENTS,
        tables={
            f"{group or title}; {words}": partial(
                table, camera=camera, group=group, labels=labels, columns=(*METRICS, *columns)
            )
            for group in groups
            for camera, words in cameras.items()
        }
        | {title: partial(_of_projected, make) for title, make in (tables or {}).items()},
        figures={
            name: partial(_of_projected, partial(make, labels=labels))
            for name, make in drawn.items()
        },
    )
