"""Study: a tag on a mobile robot that goes round, followed until that fails, or for three hours.

Five estimators follow it without a known tag, servoing thesis 2.3.7; one does with a known tag in
each lap, without and with tension correction, 5.3.1. What is not printed is run at three values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    bar_style,
    draw_curve,
    line_style,
    new_figure,
    phase_of,
    plain_numbers,
)
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.rows import Row
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot, robot_reference
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, SHADED, nth_look
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_mobile_robot"
LOG_RATE = 5.0
"""Rows of the log per second [Hz]."""

SLACK = 0.24
"""Tension at which a cable counts as slack [N]: the accuracy of the sensors, thesis table A.6."""

REFERENCE = 10
"""The lap with which paths are compared, as in the thesis."""

BEFORE = 1.0
"""Time before the worst estimate of a lap in which slack cables are counted [s]."""

CORNERS, BEHIND = (0.1515, 0.3485, 0.6515, 0.8485), 0.1
"""Where in a lap, from 0 to 1, the target is in the middle of a corner of the scenario's track, and
how far behind it the platform counts as at the corner."""

SAME_PLACE = 0.7
"""Length of the mean of unit vectors at the phases of a lap, from which they are at one place: 1
where all are the same, 0 where they are all over the lap."""

PHASES = 40
MOMENTS = (np.arange(PHASES) + 0.5) / PHASES
"""Moments of a lap, from 0 to 1, of which lengths, places and tensions are measured."""

SHOWN, TENSION_LAPS = (1, 10, 20), (1, 2, 10, 20, 30)
"""Laps of which the path, and tensions, are measured, beside the last whole one."""

FREE = 2
"""Cables of eight that may be slack while six hold the platform."""

THRESHOLD = 1.0
"""Tension below which the scenario corrects [N], 5.3.1."""

AS_CHOSEN, KNOWN = "as chosen", ("plain", "corrected")
"""The choice of the scenario, and ways to follow the tag with a known one in each lap."""

VIEWED = (
    "estimator control_integration", "estimator cable_lengths",
    "estimator cable_lengths_elastic_pulleys",
)  # fmt: skip
"""Ways to follow the tag in other views."""


# What is run.


PLAIN = "tension_management=null"
ESTIMATORS = {
    "control_integration": (1, 12), "cable_lengths": (4, 2), "cable_lengths_elastic": (5, 3),
    "cable_lengths_pulleys": (6, 3), "cable_lengths_elastic_pulleys": (7, 4),
}  # fmt: skip
"""Estimators, their numbers, and laps after which they failed without a known tag, 2.3.7."""

WAYS = {
    **{
        f"estimator {kind}": (
            f"no known tag, estimator {number}, {kind.replace('_', ' ')}",
            (PLAIN, "estimator.known_tag=null", f"estimator.kind={kind}"), 30, number, printed,
        )
        for kind, (number, printed) in ESTIMATORS.items()
    },
    "plain": ("no correction", (PLAIN,), 60, 1, 29),
    "corrected": ("with correction", (), 700, 1, 700),
}  # fmt: skip
"""Ways to follow the tag: words, changes, most laps, number of the estimator, printed laps."""

VIEW_ANGLE = 59.4
"""Angle of view along the image's short side [deg]. Source: table A.4."""


def view_margin(distance: float, edge: float) -> float:
    """How far a tag of this edge, parallel to the image and in its middle, may go along its short
    side until a corner leaves it [m]; distance from the camera [m]."""
    return distance * math.tan(math.radians(VIEW_ANGLE / 2.0)) - edge / 2.0


CHOSEN_MARGIN = view_margin(0.30, 0.06)
"""That of the scenario [m]."""


def track(length: float, width: float, radius: float) -> dict[str, Any]:
    """Another track [m]."""
    sides = {"length": length, "width": width, "corner_radius": radius}
    changes = tuple(f"target.motion.mobile_robot.{side}={size:g}" for side, size in sides.items())
    return {"words": f"track {length:.2f} x {width:.2f} m", "changes": changes}


VARIED: dict[str, dict[str, Any]] = {
    "track smaller": track(0.2, 0.12, 0.04),
    "track larger": track(0.29, 0.18, 0.06),
    "friction none": {"words": "no friction", "friction": 0.0},
    "friction more": {"words": "friction x 3", "friction": 3.0},
    **{
        name: {"words": words, "changes": (f"perturbations.winch_{change}",)}
        for name, words, change in (
            ("offset less", "winches run off by 0.5 mm/s", "offset=0.0005"),
            ("offset more", "winches run off by 2 mm/s", "offset=0.002"),
            ("spread less", "+- 0.1 mm/s", "offset_spread=0.0001"),
            ("spread more", "+- 0.4 mm/s", "offset_spread=0.0004"),
        )
    },
}
"""What is not printed, less and more than chosen: arguments of `case_of`."""

VIEWS: dict[str, dict[str, Any]] = {
    (words := f"view {distance:.2f} m, {1e3 * edge:.0f} mm"): {
        "words": words,
        "changes": (
            f"target.size={edge:g}",
            f"desired={{position: [0, 0, {distance:g}], angles_deg: [180, 0, 180]}}",
            f"initial_pose={{position: [0.0, -0.08, {distance + 0.04:g}]}}",  # near its middle
        ),
        "margin": view_margin(distance, edge),
    }
    for distance, edge in ((0.20, 0.06), (0.20, 0.09), (0.16, 0.03), (0.16, 0.06))
}
"""Neither distance nor size of the tag is printed: 0.16 m is the distance of case I, 0.20 m the
nearest at which the lens focuses, table A.4; the tag keeps its height."""

VARIED_LAPS, QUICK_LAPS = 60, 2


def cases(form: Form) -> Iterator[Case]:
    """All configurations, or the few of the quick form for two laps."""
    for name in ("estimator cable_lengths", "plain", "corrected") if form.quick else WAYS:
        yield case_of(form, name)
    if form.quick:
        return
    for choices, names in ((VARIED, (*KNOWN, *VIEWED[1:])), (VIEWS, VIEWED)):
        for (choice, more), name in product(choices.items(), names):
            yield case_of(form, name, choice, **more)


def case_of(
    form: Form, name: str, choice: str = AS_CHOSEN, *, words: str = "",
    changes: tuple[str, ...] = (), friction: float = 1.0, margin: float = CHOSEN_MARGIN,
) -> Case:  # fmt: skip
    """A way to follow the tag under a choice of what is not printed: its words, changes of the
    scenario, times the friction of the winches of the robot's file, and the view's margin [m]."""
    way, more, laps, estimator, printed = WAYS[name]
    configuration = name
    if choice != AS_CHOSEN:
        configuration, laps = f"{choice}, {name}", min(laps, VARIED_LAPS)
        way = f"{words}, {f'estimator {estimator}' if name.startswith('estimator') else name}"
    laps = QUICK_LAPS if form.quick else laps
    keys = {
        "configuration": configuration, "words": way, "asked_laps": laps, "friction": friction,
        "way": name, "choice": choice, "estimator": estimator, "printed_laps": printed,
        "margin_m": margin,
    }  # fmt: skip
    call = partial(follow, (*changes, *more), laps, friction)
    return Case(keys=keys, call=call, seeds=form.times(10))


# A run.


def follow(changes: Sequence[str], laps: int, friction: float, seed: int) -> Row:
    """The scenario with changes, for some laps, with so many times the winches' friction.

    Returns:
        outcome; failed, true if it ended before its laps were done; laps_done, until it ended;
        underactuated_at_end_s, for how long more than two cables had been slack then;
        `lap_numbers`; the arrays of `lap_curves`.
    """
    items = [*changes, f"seed={seed}"]
    robot = "acrobot_large" if friction == 1.0 else with_friction(friction)
    with robot_reference(robot) as name:
        scenario = load_scenario(SCENARIO, [*items, f"robot={name}"])
        assert scenario.target.motion is not None
        assert scenario.target.motion.mobile_robot is not None
        lap_time = scenario.target.motion.mobile_robot.lap_time
        scenario.duration, scenario.log_rate = laps * lap_time, LOG_RATE
        result = ServoRun(choose_compiled_loop(scenario)).simulate()
    done, failed = result.sim_time / lap_time, bool(result.outcome != Outcome.TIMEOUT)
    under = times_beyond(result.log["time"], slack_cables(result) > FREE)
    curves = lap_curves(result, laps, lap_time)
    return {
        "outcome": Outcome(result.outcome).name.lower(), "failed": failed, "laps_done": done,
        "underactuated_at_end_s": under[-1],
        "laps_to_failure": done if failed else np.inf,
        **lap_numbers(curves, done), **curves,
    }  # fmt: skip


def with_friction(factor: float) -> Robot:
    """The scenario's robot with other friction of its winches."""
    robot: Robot = load_robot("acrobot_large")
    friction = robot.winch.friction
    assert friction is not None
    for name in ("coulomb", "static", "viscous"):
        setattr(friction, name, factor * getattr(friction, name))
    return robot


def slack_cables(result: ServoRun) -> Array:
    """Numbers of slack cables in the rows of the log, shape (n,)."""
    return np.asarray(np.sum(result.log["tensions"] < SLACK, axis=1))


def lap_curves(result: ServoRun, laps: int, lap_time: float) -> dict[str, Array]:
    """Numbers of each lap, and quantities at moments of laps; NaN beyond the end of the run.

    Args:
        result: Of a run.
        laps: Its laps.
        lap_time: Time of one [s].

    Returns:
        Of each lap, shape (laps,): most_slack, the most cables slack at once; estimate_m,
        estimate_rad, largest error of the pose estimate; estimate_z_m, how far it is too high at
        the end; seen, share of images with the tag; tension_n, largest tension; path_m, largest
        distance from the path of lap `REFERENCE`; one_slack, two_slack, share of the lap with a
        slack cable, and with two or more; underactuated_s, longest time with more than two;
        at_threshold, mean number of cables within `SLACK` of `THRESHOLD`; estimate_at, where in
        the lap the estimate is worst, from 0 to 1; slack_at_estimate, the most cables slack at once
        in the time `BEFORE` that; path_at, where the path is farthest away, from 0 to 1. sums_m, of
        the unstrained lengths at moments of each lap, shape (laps, `PHASES`); paths_m, positions of
        the platform at these moments of the laps `SHOWN` and the last whole one, shape (4,
        `PHASES`, 3); tensions_n, at these moments of the laps `TENSION_LAPS` and the last whole
        one, shape (6, `PHASES`, m).
    """
    log = result.log
    times, poses, estimates = log["time"], log["X_WP"], log["X_WP_estimated"]
    positions, tensions, slack = poses[:, 4:], log["tensions"], slack_cables(result)
    distance, angle = pose_rows_distance(poses, estimates)
    phases = MOMENTS * lap_time

    def at_phases(numbers: Sequence[int], values: Array) -> Array:
        """Values at moments of laps, counted from 1, shape (laps, PHASES, ...)."""
        when = np.add.outer((np.array(numbers) - 1) * lap_time, phases)
        columns = values.reshape(len(values), -1).T
        moments = np.array([np.interp(when, times, c, right=np.nan) for c in columns])
        return np.moveaxis(moments, 0, -1).reshape(*when.shape, *values.shape[1:])

    by_lap = Frame({
        "slack": slack, "one": slack >= 1, "two": slack >= 2, "distance": distance, "angle": angle,
        "high": estimates[:, 6] - poses[:, 6], "seen": log["found"][:, 0],
        "tension": np.max(tensions, axis=1), "under": times_beyond(times, slack > FREE),
        "near": np.sum(np.abs(tensions - THRESHOLD) < SLACK, axis=1),
    }).groupby(np.floor(times / lap_time + 1e-9).astype(int))  # fmt: skip
    worst = by_lap["distance"].idxmax()
    numbers = by_lap.agg(
        most_slack=("slack", "max"), estimate_m=("distance", "max"), estimate_rad=("angle", "max"),
        estimate_z_m=("high", "last"), seen=("seen", "mean"), tension_n=("tension", "max"),
        one_slack=("one", "mean"), two_slack=("two", "mean"), underactuated_s=("under", "max"),
        at_threshold=("near", "mean"),
    ).assign(
        estimate_at=times[worst] / lap_time - worst.index,
        slack_at_estimate=[
            np.max(slack[(times > time - BEFORE) & (times <= time)]) for time in times[worst]
        ],
    ).reindex(range(laps))  # fmt: skip
    every, last = range(1, laps + 1), last_lap(result.sim_time / lap_time)
    reference = at_phases([REFERENCE], positions)
    away = np.linalg.norm(at_phases(every, positions) - reference, axis=2)
    path, path_at = np.max(away, axis=1), phases[np.argmax(away, axis=1)] / lap_time
    return {
        **{name: column.to_numpy(float) for name, column in numbers.items()},
        "path_m": path, "path_at": np.where(np.isfinite(path), path_at, np.nan),
        "sums_m": at_phases(every, np.sum(log["unstrained_lengths"], axis=1)),
        "paths_m": at_phases((*SHOWN, last), positions),
        "tensions_n": at_phases((*TENSION_LAPS, last), tensions),
    }  # fmt: skip


def last_lap(done: float) -> int:
    """Number of the last whole lap, from 1, of a run that ended after so many."""
    return max(int(done + 1e-9), 1)


def times_beyond(times: Array, beyond: np.ndarray) -> Array:
    """For how long something has been so without a break, at each time [s]; all of shape (n,)."""
    last = np.maximum.accumulate(np.where(beyond, -1, np.arange(len(times))))
    since = np.where(last >= 0, times[np.maximum(last, 0)], times[0])
    return np.where(beyond, times - since, 0.0)


def over(reduce: Callable[[Array], Any], values: Array) -> float:
    """A number of those values that are not NaN; NaN if all are."""
    numbers = values[np.isfinite(values)]
    return float(reduce(numbers)) if len(numbers) else np.nan


def rise(sums: Array, early: int, late: int, whole: bool = True) -> float:
    """Largest rise of the sum of lengths from a lap, counted from 1, to another, at the same moment
    of the lap [m]; NaN if there is no such lap, or if it is not whole."""
    if late > len(sums):
        return np.nan
    change = sums[late - 1] - sums[early - 1]
    return np.nan if whole and not np.all(np.isfinite(change)) else over(np.max, change)


def lap_numbers(curves: Mapping[str, Array], done: float) -> dict[str, Any]:
    """What facts are about; NaN if a run did not come to that lap.

    Args:
        curves: See `lap_curves`.
        done: How many laps were done.

    Returns:
        Errors of the estimate: drift_m, how far it is too high after 12 laps; estimate_max_m, the
        largest; estimate_step_m, its largest change from lap to lap before lap 12. In the last lap:
        last_estimate_m, last_estimate_rad, last_slack_at_estimate, and farthest_at_corner, true if
        the path of the last whole lap is farthest off at a corner. Paths: path_1_m, path_20_m,
        path_24_m of single laps, path_usual_m, median after the first lap, path_late_m, the largest
        after lap `REFERENCE`. Rises of the sum of lengths: rise_10_m from lap 2 to 10, rise_20_m
        from 10 to 20, rise_last_m from 20 to the last whole one. Shares and times of single laps:
        one_slack_1, two_slack_10, two_slack_20, underactuated_20_s. Cables on the threshold after
        the first lap: at_threshold_usual, the median, at_threshold_least. Tensions:
        tension_change_30_n, root mean square change from lap 10 to 30, tension_change_last_n to the
        last one. largest_slack: the most cables slack at once.
    """

    def at(name: str, lap: int) -> float:
        return float(curves[name][lap - 1]) if lap <= len(curves[name]) else np.nan

    def last(name: str) -> float:
        return over(lambda values: values[-1], curves[name])

    def change(first: int, second: int) -> float:
        apart = curves["tensions_n"][second] - curves["tensions_n"][first]
        return float(np.sqrt(np.mean(apart**2)))

    ten, thirty = TENSION_LAPS.index(REFERENCE), TENSION_LAPS.index(30)
    sums, behind = curves["sums_m"], last("path_at") - np.array(CORNERS)
    end = last_lap(done)
    return {
        "drift_m": at("estimate_z_m", 12),
        "estimate_max_m": over(np.max, curves["estimate_m"]),
        "estimate_step_m": over(np.max, np.abs(np.diff(curves["estimate_m"][:11]))),
        "last_estimate_m": last("estimate_m"), "last_estimate_rad": last("estimate_rad"),
        "last_slack_at_estimate": last("slack_at_estimate"),
        "farthest_at_corner": bool(np.any((behind >= 0.0) & (behind <= BEHIND))),
        "path_1_m": at("path_m", 1), "path_20_m": at("path_m", 20), "path_24_m": at("path_m", 24),
        "path_usual_m": over(np.median, curves["path_m"][1:]),
        "path_late_m": over(np.max, curves["path_m"][REFERENCE:]),
        "rise_10_m": rise(sums, 2, REFERENCE, whole=False),
        "rise_20_m": rise(sums, REFERENCE, 20),
        "rise_last_m": rise(sums, 20, end, whole=False) if end > 20 else np.nan,
        "one_slack_1": at("one_slack", 1), "two_slack_10": at("two_slack", 10),
        "two_slack_20": at("two_slack", 20), "underactuated_20_s": at("underactuated_s", 20),
        "at_threshold_usual": over(np.median, curves["at_threshold"][1:]),
        "at_threshold_least": over(np.min, curves["at_threshold"][1:]),
        "tension_change_30_n": change(ten, thirty), "tension_change_last_n": change(ten, -1),
        "largest_slack": over(np.max, curves["most_slack"]),
    }  # fmt: skip


# What facts ask of several runs.


def laps_words(runs: Frame) -> str:
    """Laps until failure of runs, such as `median 12.4 (3.9 to 20.0), 2 of 10 did not fail`."""
    laps, lasting = runs["laps_done"], int((~runs["failed"].astype(bool)).sum())
    words = f"median {laps.median():.1f} ({laps.min():.1f} to {laps.max():.1f})"
    return words + (f", {lasting} of {len(runs)} did not fail" if lasting else "")


def at_one_place(phases: Array) -> tuple[float, float]:
    """Mean of phases of a lap, from 0 to 1, and how much they are at one place, from 0 to 1."""
    mean = np.mean(np.exp(2j * np.pi * phases[np.isfinite(phases)]))
    return float(np.angle(mean) / (2.0 * np.pi) % 1.0), float(np.abs(mean))


def spikes(rows: Frame) -> tuple[list[bool], str]:
    """Whether errors by lengths are largest at one place of the track, by each and of the four."""
    places, agreement, words = [], [], []
    for kind, (number, _) in list(ESTIMATORS.items())[1:]:
        arrays = list(select(rows, configuration=f"estimator {kind}")["arrays"])
        path, error, phase = (
            np.concatenate([laps[name] for laps in arrays])
            for name in ("path_at", "estimate_m", "estimate_at")
        )
        whole = np.isfinite(path)
        if not np.any(whole):
            raise MissingRuns(f"whole laps of estimator {number}")
        place, share = at_one_place(phase[whole & (error >= np.median(error[whole]))])
        places.append(place)
        agreement.append(share)
        words.append(f"{number}: {place:.2f} of the lap ({share:.2f})")
    agreement.append(at_one_place(np.array(places))[1])
    held = [share >= SAME_PLACE for share in agreement]
    return held, f"{'; '.join(words)}; the four together ({agreement[-1]:.2f})"


def laps_against_print(rows: Frame, of: str, count: int) -> Frame:
    """Medians of laps to failure over the printed ones: a column for each way to follow the tag, a
    row for each of `count` values of a key column; MissingRuns if runs lack."""
    shares = (rows["laps_to_failure"] / rows["printed_laps"]).groupby([rows[of], rows["way"]])
    table = shares.median().unstack()
    if len(table) < count or table.isna().any(axis=None):
        raise MissingRuns(f"{count} values of {of}")
    return table


def as_printed(shares: Frame) -> Frame:
    """True if laps are within a factor of two of the printed ones."""
    return (shares >= 0.5) & (shares <= 2.0)


def laps_by_configuration(rows: Frame) -> str:
    """Words on the laps of each configuration."""
    groups = rows.groupby("words", sort=False)
    return "; ".join(f"{words}: {laps_words(runs)}" for words, runs in groups)


def lengths_depend(rows: Frame) -> tuple[list[bool], str]:
    """Whether estimators 4 and 7 last as printed with some choice; whether one does, or a choice
    changes how long they last."""
    runs = rows[rows["way"].isin(VIEWED[1:]) & ~rows["choice"].str.startswith("view")]
    shares = laps_against_print(runs, "choice", 1 + len(VARIED))
    longest = shares["estimator cable_lengths"]
    changed = (longest != longest[AS_CHOSEN]).any()
    held = [as_printed(shares).all(axis=1).any(), as_printed(shares).any(axis=None) or changed]
    return held, laps_by_configuration(runs)


def of_views(rows: Frame) -> Frame:
    """Runs in the view of the scenario and in others, with nothing else changed."""
    views = rows["choice"].str.startswith("view") | (rows["choice"] == AS_CHOSEN)
    return rows[rows["way"].isin(VIEWED) & views]


def view_decides(rows: Frame) -> tuple[list[bool], str]:
    """Whether all three estimators last as printed in some view; whether Est. 1, which fails in all
    views, lasts the longer the more margin there is."""
    runs = of_views(rows)
    shares = laps_against_print(runs, "margin_m", 1 + len(VIEWS))
    first = list(shares[VIEWED[0]])
    held = [as_printed(shares).all(axis=1).any(), first == sorted(first) and first[0] < first[-1]]
    return held, laps_by_configuration(runs.sort_values("margin_m", kind="stable"))


# What is drawn.


def by_words(rows: Frame) -> dict[str, Frame]:
    """Runs with a known tag, as chosen, by words; NothingToDraw if there are none."""
    runs = rows[rows["configuration"].isin(KNOWN)]
    if not len(runs):
        raise NothingToDraw
    return dict([*runs.groupby("words", sort=False)])


def first_run(runs: Frame) -> tuple[Mapping[str, Array], int]:
    """Curves of a configuration's first run, and its last whole lap; NothingToDraw without runs."""
    if not len(runs):
        raise NothingToDraw
    return runs["arrays"].iloc[0], last_lap(runs["laps_done"].iloc[0])


def laps_figure(rows: Frame) -> Figure:
    """Laps until failure, sums of lengths, slack cables, paths."""
    figure, panels = new_figure(2, 2, (13.0, 10.0), "A tag on a mobile robot that goes round")
    ends, lengths, slack, paths = panels.flat
    draw_laps(ends, rows)
    for number, (words, runs) in enumerate(by_words(rows).items()):
        style = line_style(nth_look(number))
        for k, curves in enumerate(runs["arrays"]):
            sums = curves["sums_m"]
            rise = np.fmax.reduce(sums - sums[min(1, len(sums) - 1)], axis=1)
            lengths.plot(np.arange(1, len(rise) + 1), rise, **style, linewidth=0.9,
                         label=words if k == 0 else None)  # fmt: skip
        most = np.fmax.reduce([curves["most_slack"] for curves in runs["arrays"]], axis=0)
        slack.step(np.arange(1, len(most) + 1), most, where="mid", **style, label=words)
        draw_paths(paths, runs, f"{words}, ", 4 * number)
    slack.axhspan(FREE + 0.5, 8.2, color=SHADED.color, linewidth=0.0,
                  label="fewer than six cables hold the platform")  # fmt: skip
    lengths.set(ylabel="rise of the sum of lengths since lap 2 [m]",
                title="cable that was paid out, worst moment of each lap")  # fmt: skip
    slack.set(ylabel="most cables slack at once, of all runs", title="slack cables")
    for axes in (lengths, slack):
        axes.set(xlabel="lap", xscale="log")
        plain_numbers(axes.xaxis)
        axes.legend(loc="best")
    slack.set_ylim(-0.2, 8.2)
    paths.set(title="path of the platform, first run")
    if paths.get_legend_handles_labels()[0]:  # below: lost platforms go through the middle
        paths.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=6.0, fontsize=8, ncols=3
        )
    return figure


def draw_laps(axes: Any, rows: Frame) -> None:
    """Bars of laps until the end without correction: medians, each run, what is printed."""
    plain = rows[(rows["choice"] == AS_CHOSEN) & (rows["way"] != "corrected")]
    labels = []
    for place, (way, runs) in enumerate(plain.groupby("way", sort=False)):
        ends, laps = runs["laps_done"], runs["printed_laps"].iloc[0]
        shown = [
            axes.bar(place, ends.median(), 0.6, **bar_style(nth_look(0))),
            *axes.plot(np.full(len(ends), place), ends, "x", color=nth_look(7).color),
            *axes.plot([place - 0.4, place + 0.4], [laps, laps], **line_style(nth_look(1)),
                       linewidth=2.5),
        ]  # fmt: skip
        number = runs["estimator"].iloc[0]
        labels.append(f"{number}, known tag" if way == "plain" else f"estimator {number}")
    axes.set_xticks(range(len(labels)), labels, rotation=20)
    axes.set(ylabel="laps until tracking ends", title="no correction")
    if labels:
        axes.legend(shown, ["median", "a run", "published"], loc="upper left")


def draw_paths(axes: Any, runs: Frame, words: str = "", look: int = 0) -> None:
    """Paths of the platform from above in laps of the first run of a configuration."""
    curves, last = first_run(runs)
    laps = dict(zip((*SHOWN, last), curves["paths_m"], strict=True))
    for number, (lap, path) in enumerate(sorted(laps.items())):
        finite = np.all(np.isfinite(path), axis=1)
        if np.any(finite):
            closed = path[[*range(PHASES), 0]] if np.all(finite) else path[finite]
            mark = nth_look(look + number)
            axes.plot(
                *closed[:, :2].T, **line_style(mark), label=f"{words}lap {lap}", marker=mark.marker,
                markevery=(2 * number, 8), markerfacecolor="white", markersize=5.0,
            )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x in W [m]", ylabel="y in W [m]")


def paths_figure(rows: Frame, name: str, number: str) -> Figure:
    """Figures 5.19 and 5.20."""
    title = f"Figure {number}: path of the platform from above, {WAYS[name][0]}, first run"
    figure, axes = new_figure(1, 1, (9.0, 7.6), title)
    draw_paths(axes, rows[rows["configuration"] == name])
    axes.legend(loc="center")
    return figure


def lengths_figure(rows: Frame) -> Figure:
    """Figure 5.21: sums of lengths over single laps."""
    title = "Figure 5.21: sum of the cable lengths during single laps, first run"
    figure, axes = new_figure(1, 1, (11.0, 6.6), title)
    for first, (words, runs) in zip((0, 4), by_words(rows).items(), strict=False):
        sums = runs["arrays"].iloc[0]["sums_m"]
        begun = np.flatnonzero(np.any(np.isfinite(sums), axis=1)) + 1
        laps = sorted({*(lap for lap in (10, 20) if lap in begun), int(begun[-1])})
        for number, lap in enumerate(laps, start=first):
            draw_curve(axes, MOMENTS, sums[lap - 1], nth_look(number), f"{words}, lap {lap}",
                       phase=phase_of(number, 8))  # fmt: skip
    axes.set(xlabel="part of the lap [-]", ylabel="sum of the cable lengths [m]", xlim=(0.0, 1.0))
    axes.legend(loc="best")
    return figure


def tensions_figure(rows: Frame, name: str, words: str, laps: tuple[int, ...]) -> Figure:
    """Figures 2.18, 5.22 and 5.23: tensions in laps of the first run, and in its last whole one."""
    curves, last = first_run(rows[rows["configuration"] == name])
    tensions = curves["tensions_n"]
    panels = {lap: tensions[TENSION_LAPS.index(lap)] for lap in laps} | {last: tensions[-1]}
    panels = {lap: panel for lap, panel in sorted(panels.items()) if np.any(np.isfinite(panel))}
    lines = -(-len(panels) // 2)
    title = f"Cable tensions behind a mobile robot, {words}"
    figure, grid = new_figure(lines, 2, (14.0, 1.8 + 3.6 * lines), title)
    flat = list(np.ravel(grid))
    for axes, (lap, panel) in zip(flat, panels.items(), strict=False):
        count = panel.shape[1]
        for k in range(count):
            draw_curve(axes, MOMENTS, panel[:, k], nth_look(k), f"cable {k + 1}",
                       phase=phase_of(k, count), linewidth=1.2, markersize=4.0)  # fmt: skip
        axes.axhline(THRESHOLD, **line_style(BOUND), label="threshold of the correction")
        axes.set_title(f"lap {lap}")
        axes.set(xlabel="part of the lap [-]", ylabel="tension [N]", xlim=(0.0, 1.0))
    for axes in flat[len(panels) :]:
        axes.remove()
    figure.legend(*flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return figure


def choices_figure(rows: Frame) -> Figure:
    """Laps until the end under other choices of what is not printed, every run."""
    rows = rows[~rows["choice"].str.startswith("view")]
    if (rows["choice"] == AS_CHOSEN).all():
        raise NothingToDraw
    title = "What the thesis does not print, at three values each"
    figure, panels = new_figure(2, 1, (10.0, 13.0), title)
    for axes, ways, words in (
        (panels[0], KNOWN, "known tag each lap, control integration"),
        (panels[1], VIEWED[1:], "no known tag, estimators by cable lengths"),
    ):
        groups = rows[rows["way"].isin(ways)].groupby("words", sort=False)
        for place, (_, runs) in enumerate(groups):
            ends, look = runs["laps_done"], nth_look(ways.index(runs["way"].iloc[0]))
            axes.barh(place, ends.median(), 0.6, **bar_style(look))
            axes.plot(ends, np.full(len(ends), place), linestyle="", marker="x",
                      color=nth_look(7).color)  # fmt: skip
        axes.set_yticks(range(len(groups)), [label for label, _ in groups])
        axes.set_xscale("log")
        plain_numbers(axes.xaxis)
        axes.set_xlim(1.0, max(axes.get_xlim()[1], 40.0))
        axes.invert_yaxis()
        axes.set(xlabel="laps until tracking ends, or the run does (crosses: each run)")
        axes.set_title(words, loc="right")
    return figure


def views_figure(rows: Frame) -> Figure:
    """Laps until the end over how far the tag may drift in the image, by estimator."""
    rows = of_views(rows)
    if (rows["choice"] == AS_CHOSEN).all():
        raise NothingToDraw
    figure, axes = new_figure(1, 1, (9.0, 6.0), "How long the tag is followed, by its view")
    for way, runs in rows.groupby("way", sort=False):
        look, number = nth_look(VIEWED.index(way)), runs["estimator"].iloc[0]
        margin, laps = 1e3 * runs["margin_m"], runs["printed_laps"].iloc[0]
        middle = runs["laps_done"].groupby(margin).median()
        axes.plot(middle.index, middle, marker=look.marker, label=f"estimator {number}, median",
                  **line_style(look))  # fmt: skip
        axes.plot(margin, runs["laps_done"], linestyle="", marker=look.marker, color=look.color,
                  markerfacecolor="none", markersize=4)  # fmt: skip
        axes.axhline(laps, linewidth=0.8, linestyle=":", color=look.color)
        axes.annotate(f"published, estimator {number}", (1.01, laps),
                      xycoords=("axes fraction", "data"), ha="left", va="center",
                      fontsize=8)  # fmt: skip
    axes.set(xlabel="margin of the tag along the image's short side [mm]",
             ylabel="laps until tracking ends, or the run does (hollow: each run)",
             ylim=(0.0, None))  # fmt: skip
    axes.legend(loc="best")
    return figure


# The study.


def worst_of_all(rows: Frame) -> dict[str, Any]:
    """The worst of all laps of all runs, by configuration and curve; NaN if there is none."""
    names = [name for name, curve in rows["arrays"].iloc[0].items() if curve.ndim == 1]
    return {
        configuration: {
            name: over(
                np.min if name == "seen" else np.max,
                np.concatenate([laps[name] for laps in runs["arrays"]]),
            )
            for name in names
        }
        for configuration, runs in rows.groupby("configuration", sort=False)
    }


def outcomes(rows: Frame) -> Frame:
    """What came of every configuration."""
    worst = worst_of_all(rows)
    return Frame(
        {
            "configuration": runs["words"].iloc[0],
            "printed laps": runs["printed_laps"].iloc[0],
            "laps until failure": laps_words(runs),
            "most slack": worst[name]["most_slack"],
            "estimate [mm]": 1e3 * worst[name]["estimate_m"],
            "estimate [deg]": np.degrees(worst[name]["estimate_rad"]),
            "tension [N]": worst[name]["tension_n"],
        }
        for name, runs in rows.groupby("configuration", sort=False)
    )


ASSUMPTIONS = (
    "The track is not printed: a rectangle of 0.26 x 0.16 m with rounded corners, as fast as the "
    "printed gains follow with the tag in view; a smaller and a larger one are run beside it.",
    "The tag turns with the mobile robot, all round once a lap, which the platform cannot: the "
    "rotation about the optical axis is left free, and the platform keeps its yaw in the estimate.",
    "Friction of the winches is not printed: that of the robot's file; none and three times as "
    "much are run beside it.",
    "By what winches run off their commands is not printed: 1 mm/s each, fitted to the printed "
    "drift of 0.3 m in 12 laps, and up to 0.2 mm/s more or less, fitted to 0.15 m of cable in 20; "
    "half and twice as much of each is run beside it. Without it nothing grows: lengths that "
    "follow the integral of the commands come back to what they were after each lap.",
    "Stiffness and damping of the cables as mounted are those fitted for case study IX.",
    "Believed wrongly: exit and anchor points by 5 mm, manufacturing errors as 3.3.3 and 4.3.1 "
    "have them and as in case studies I and IX; the camera by 5 mm and 1 deg, the first pose by 2 "
    "mm and 0.2 deg, chosen; in directions drawn for each seed.",
    "Size and distance of the tag are not printed: 60 mm at 0.30 m; estimators 1, 4 and 7 follow "
    "it at four others, too.",
    "The estimator of 5.3.1 is that of 2.3.7 that lasts 210 s, control integration.",
    "A cable counts as slack below 0.24 N, the accuracy of the sensors.",
)

STUDY = Study(
    name="mobile-robot",
    title="A tag on a mobile robot that goes round, followed until that fails, or for three hours",
    source="servoing thesis 2.3.7, 5.3.1",
    cases=cases,
    coarse=True,
    parameters=lambda form: {"scenario": dump_typed(load_scenario(SCENARIO))},
    numbers=worst_of_all,
    finds={"spikes": spikes, "lengths_depend": lengths_depend, "view_decides": view_decides},
    tables={"A tag on a mobile robot": outcomes},
    figures={
        "mobile_robot": laps_figure,
        "choices": choices_figure,
        "views": views_figure,
        **{
            f"tensions_{file}": partial(tensions_figure, name=name, words=words, laps=laps)
            for file, name, words, laps in (
                ("estimator", VIEWED[1], "figure 2.18, Est. 4, no known tag", (1, 2)),
                ("plain", "plain", "figure 5.22, no correction", (1, 10, 20)),
                ("corrected", "corrected", "figure 5.23, with correction", (1, 10, 30)),
            )
        },
        "paths_plain": partial(paths_figure, name="plain", number="5.19"),
        "paths_corrected": partial(paths_figure, name="corrected", number="5.20"),
        "lengths_by_lap": lengths_figure,
    },
    assumptions=ASSUMPTIONS,
)  # fmt: skip
