"""Study: do detectors of failures cry wolf, and what do they miss?

ACROBOT with its large platform moves under a visual servo by motor torques, from a pose and at a
speed, with a servo scheme, noise of sensors and wrong beliefs that are drawn for each run. All
detectors of section `emergency` look; nobody reacts.

* Undisturbed: nothing fails. What is an alarm, is a false one.
* Every single cable breaks, at several poses and times.
* The other failures: every winch is blocked, every motor loses power, every tension sensor and
  encoder freezes, the camera goes dark or goes on to show its last image.

No limit is fitted to these runs: those of lengths and torque follow from the noise and constant
errors of sensors, from static friction, from bounds of what is wrong with the believed geometry,
which are the largest that are drawn here, and from an accepted rate of false alarms; see
`estimation.break_detection` and `estimation.failure_watch`. Column `residual_m` is the largest
residual of lengths that stayed in a row as long as an alarm needs, whether or not a tension was
near nothing, too. Lag, dark and late have limits that were chosen.

A break counts as told when the right cable is named from then on until the run ends, in time within
`IN_TIME`, late after it. Cables that are wanted with less than `detectable_tension` are not certain
to be told in time: a constant error of their sensor may stand for what they pull.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.estimation.break_detection import detectable_tension
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.emergency import silent_readings
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_broken_redistributed"

NOTHING, BREAK = "nothing", "cable breaks"
JAM, POWER = "winch jams", "power lost"
TENSION, ENCODER = "tension sensor freezes", "encoder freezes"
DARK, LATE = "camera goes dark", "image stays"

ALARMS = {
    BREAK: "found_broken",
    JAM: "found_jammed",
    POWER: "found_powerless",
    TENSION: "frozen_tension",
    ENCODER: "frozen_encoder",
    DARK: "camera_dark",
    LATE: "camera_late",
}
"""Column of the log by what fails."""

EVENTS = {
    BREAK: "{{kind: cable_breaks, time: {time:g}, cable: {which}}}",
    JAM: "{{kind: winch_jams, time: {time:g}, winch: {which}}}",
    POWER: "{{kind: power_lost, time: {time:g}, winch: {which}}}",
    TENSION: "{{kind: sensor_freezes, time: {time:g}, sensor: tension, cable: {which}}}",
    ENCODER: "{{kind: sensor_freezes, time: {time:g}, sensor: encoder, cable: {which}}}",
}
"""Event of section `failures` that it is."""

FAULTS = {DARK: "dead", LATE: "frozen"}
"""Fault of the camera that it is."""

UNDISTURBED = (1000, 4)
"""Undisturbed runs, in the full form and in the quick one."""

SHORT, LONG, EVERY = 0.6, 3.0, 25
"""Durations of undisturbed runs [s], and how often one is long."""

BREAKS = (12, 1)
"""Times that every cable breaks, each from another start."""

OTHERS = (2, 1)
"""The same of every other failure."""

TIMES = (0.3, 0.6, 1.2)
"""When something fails [s], in turn."""

IN_TIME, AFTER = 0.6, 1.5
"""Within which a break is to be told, and for how long a run goes on after a failure [s]."""

TURNED = 0.25
"""By how much a cable's direction may turn in that time, for the limit of its residual [-]."""

RATE = 500.0
"""Looks of detectors, and rows of the log, per second [Hz]."""

SCHEMES = ("2.5d", "pbvs", "ibvs")
METHODS = ("barycenter", "polygon_1_norm")
LOWEST = (1.0, 0.5, 0.2)
"""Servo schemes, distributions of tensions, and smallest wanted tensions [N], in turn: with the
last one and a corner of the polygon sensors read of cables that are there what they read of a
broken one."""

LARGEST = {
    "shift_m": 0.03, "turn_deg": 4.0, "exit_points_m": 0.003, "anchor_points_m": 0.001,
    "pose_m": 0.003, "pose_deg": 0.5, "pixel_noise_px": 0.5,
}  # fmt: skip
"""What is drawn, uniform from zero, or round it, to this."""

SEED = 35
"""Beside the number of a run, of what is drawn for it."""


def cases(form: Form) -> Iterator[Case]:
    """All failures, then undisturbed runs."""
    quick = int(form.quick)
    count = 2 if quick else len(load_robot(load_scenario(SCENARIO).robot).cables)
    for fails in ALARMS:
        for round_ in range((BREAKS if fails == BREAK else OTHERS)[quick]):
            for which in range(1 if fails in FAULTS else count):
                number = 100_000 + 1000 * round_ + which
                keys = {"fails": fails, "which": which, "number": number}
                yield Case(name=f"{fails} {which} {round_}", keys=keys)
    for number in range(UNDISTURBED[quick]):
        keys = {"fails": NOTHING, "which": -1, "number": number}
        yield Case(name=f"undisturbed {number}", keys=keys)


def overrides(keys: Mapping[str, Any]) -> list[str]:
    """What differs from the scenario in a run."""
    start, fails, number = _start(), keys["fails"], keys["number"]
    drawn = np.random.default_rng([SEED, number])
    position = start.position + LARGEST["shift_m"] * drawn.uniform(-1.0, 1.0, 3)
    angles = start.angles_deg + LARGEST["turn_deg"] * drawn.uniform(-1.0, 1.0, 3)
    share = dict(zip(LARGEST, drawn.uniform(0.0, 1.0, len(LARGEST)), strict=True))
    most = {name: share[name] * LARGEST[name] for name in LARGEST}
    begins = fail_time(keys)
    duration = begins + AFTER
    if fails == NOTHING:
        duration = LONG if number % EVERY == 0 else SHORT
    events = [EVENTS[fails].format(time=begins, which=keys["which"])] if fails in EVENTS else []
    changes = [
        f"initial_pose.position={_listed(position)}",
        f"initial_pose.angles_deg={_listed(angles)}",
        f"controller.scheme={SCHEMES[number % len(SCHEMES)]}",
        f"controller.lambda_0={drawn.uniform(1.0, 4.0):.4g}",
        f"torque_control.method={METHODS[number // 3 % len(METHODS)]}",
        f"torque_control.limits=[{LOWEST[number // 6 % len(LOWEST)]:g}, 60.0]",
        f"camera.pixel_noise={0.05 + most['pixel_noise_px']:.4g}",
        f"perturbations.exit_points={most['exit_points_m']:.4g}",
        f"perturbations.anchor_points={most['anchor_points_m']:.4g}",
        f"perturbations.initial_pose_shift.distance={most['pose_m']:.4g}",
        f"perturbations.initial_pose_shift.angle_deg={most['pose_deg']:.4g}",
        f"failures.events=[{', '.join(events)}]",
        "emergency={reaction: stop, delay: 1000.0, known: found, watch: {}}",
        f"seed={number}", f"duration={duration:g}", f"log_rate={RATE:g}",
        "integration.engine=compiled",
    ]  # fmt: skip
    if fails in FAULTS:
        fault = f"{{kind: {FAULTS[fails]}, start: {begins:g}, duration: 1000.0}}"
        changes.append(f"camera.fault={fault}")
    return changes


@cache
def _start() -> Pose:
    return load_scenario(SCENARIO).initial_pose


def fail_time(keys: Mapping[str, Any]) -> float:
    """When something fails in a run [s]."""
    return TIMES[(keys["number"] // 1000 + keys["which"]) % len(TIMES)]


def _listed(numbers: Array) -> str:
    return "[" + ", ".join(f"{number:.6g}" for number in numbers) + "]"


def measure(case: Case, _seed: int) -> dict[str, Any]:
    """A run.

    Returns:
        outcome; time_s, how long it was; false, how many alarms there were before something failed,
        of all kinds; told, whether the right detector told of the right cable or device, or, of a
        motor without power, of a drum that is blocked; by_name, whether as what it is; delay_s, of
        a break until the right cable is named for good; first, what was told first after something
        failed; named, how many other cables were named after a break; carried_n, what the cable
        that broke pulled; residual_m, torque_n_m and lag_m, the largest before something failed;
        tension_n, the smallest reading before.
    """
    scenario = load_scenario(SCENARIO, overrides(case.keys))
    run = run_scenario(scenario)
    log, fails, which = run.log, case.keys["fails"], case.keys["which"]
    times = log["time"]
    begins = np.inf if fails == NOTHING else fail_time(case.keys)
    before = times < begins - 0.5 / RATE
    alarms = {kind: first_times(log[name], times) for kind, name in ALARMS.items()}
    false = {kind: int(np.sum(found < begins)) for kind, found in alarms.items()}
    after = {
        kind: float(np.min(found)) for kind, found in alarms.items()
        if begins <= np.min(found) < np.inf
    }  # fmt: skip
    found = alarms[fails][which] if fails in alarms else np.inf
    if fails == BREAK:
        found = named_for_good(log[ALARMS[BREAK]][:, which], times)
    by_name = bool(begins <= found < np.inf)
    if fails == POWER:  # a drum that friction holds is told as blocked: a winch has failed
        found = min(found, alarms[JAM][which])
    told = bool(begins <= found < np.inf)
    wrong = np.delete(log[ALARMS[BREAK]][~before], max(which, 0), axis=1)
    row = scenario.emergency
    assert row is not None
    return {
        "outcome": Outcome(run.outcome).name.lower(),
        "time_s": float(times[-1]),
        "false": sum(false.values()),
        "false_kinds": [kind for kind, count in false.items() if count],
        "told": told,
        "by_name": by_name,
        "delay_s": float(found - begins) if told else None,
        "first": min(after, key=lambda kind: after[kind]) if after else "nothing",
        "named": int(np.sum(np.any(wrong > 0.0, axis=0))) if fails == BREAK else 0,
        "carried_n": float(log["tensions"][before][-1, which]) if fails == BREAK else None,
        "residual_m": held_in_a_row(log["break_residuals"][before], row.in_a_row),
        "torque_n_m": float(np.max(np.abs(log["torque_residual"][before]))),
        "lag_m": float(np.max(np.abs(log["length_lag"][before]))),
        "tension_n": float(np.min(log["measured_tensions"][before][1:])),
    }


def named_for_good(flags: Array, times: Array) -> float:
    """Since when flags, shape (n,), are set without a gap until the end [s]; infinite: are not."""
    unset = np.flatnonzero(flags == 0.0)
    last = int(unset[-1]) + 1 if len(unset) else 0
    return float(times[last]) if last < len(times) else float("inf")


def first_times(flags: Array, times: Array) -> Array:
    """When each column of flags, shape (n, k), was first set [s], shape (k,); infinite: never."""
    return np.where(np.any(flags > 0.0, axis=0), times[np.argmax(flags > 0.0, axis=0)], np.inf)


def held_in_a_row(residuals: Array, count: int) -> float:
    """The largest value that a column of residuals, shape (n, m), was above `count` times in a row:
    a threshold below it is an alarm, one above none."""
    windows = np.lib.stride_tricks.sliding_window_view(residuals, count, axis=0)
    return float(np.max(np.min(windows, axis=-1)))


@cache
def limits() -> tuple[float, float]:
    """Limit of a cable that pulled [m], and tension from which on breaks are certainly told [N]."""
    scenario = load_scenario(SCENARIO, ["emergency={reaction: stop, known: found}"])
    settings, torque = scenario.emergency, scenario.torque_control
    assert settings is not None
    assert torque is not None
    robot = load_robot(scenario.robot)
    limit = settings.rule(len(robot.cables)).limit(TURNED)
    least = detectable_tension(
        limit, silent=float(np.max(silent_readings(scenario, settings, robot))),
        winding_per_newton=(1.0 + torque.proportional) / torque.derivative, within=IN_TIME,
    )  # fmt: skip
    return limit, least


@statement("At most one of 1,000 undisturbed runs has a false alarm.", basis=OURS)
def false_alarms(runs: Runs) -> Finding:
    """Runs without a failure in which some detector told of one."""
    some = runs(fails=NOTHING)
    if not len(some):
        raise MissingRuns(NOTHING)
    wrong = int(np.sum(some["false"] > 0))
    kinds = sorted({kind for run in some for kind in run["false_kinds"]})
    words = (
        f"{wrong} of {len(some)} runs, {np.sum(some['time_s']):.0f} s in all"
        f"{': ' + ', '.join(kinds) if kinds else ''}; largest residual of lengths "
        f"{1e3 * some.largest('residual_m'):.1f} mm, limit from {1e3 * limits()[0]:.1f} mm"
    )
    return Finding(found=words, held=[wrong <= len(some) / 1000.0])


@statement("No break of a cable that is wanted with enough to be told is missed.", basis=OURS)
def missed_breaks(runs: Runs) -> Finding:
    """Breaks of cables that pulled with at least `limits()[1]`: which cable, in time, how soon."""
    some, least = runs(fails=BREAK), limits()[1]
    if not len(some):
        raise MissingRuns(BREAK)
    enough = [run for run in some if run["carried_n"] >= least]
    told = [bool(run["told"] and run["delay_s"] <= IN_TIME) for run in enough]
    words = (
        f"cables that pulled {least:.2f} N or more: {sum(told)} of {len(enough)} told within "
        f"{IN_TIME:g} s; {_told(some, BREAK)}; less than that pulled {len(some) - len(enough)}"
    )
    late = [run for run in some if run["told"] and run["delay_s"] > IN_TIME]
    return Finding(
        found=f"{words}; late {len(late)}, first another cable {int(np.sum(some['named'] > 0))}",
        held=told,
    )


@statement("No other failure is missed.", basis=OURS)
def missed_others(runs: Runs) -> Finding:
    """The same of all other failures."""
    findings = [_found(runs, kind) for kind in ALARMS if kind != BREAK and runs.has(fails=kind)]
    if not findings:
        raise MissingRuns(JAM)
    return Finding(
        found="; ".join(one.found for one in findings),
        held=[part for one in findings for part in one.held],
        why="A drum that does not want to turn when it is blocked or has no power, and an encoder "
        "of one that stands, tell nothing.",
    )


def _found(runs: Runs, kind: str) -> Finding:
    some = runs(fails=kind)
    if not len(some):
        raise MissingRuns(kind)
    return Finding(found=_told(some, kind), held=list(map(bool, some["told"])))


def _told(some: Runs, kind: str) -> str:
    told = some["told"].astype(bool)
    words = f"{kind}: {np.sum(told)} of {len(some)} told"
    if kind == POWER:
        words += f", {int(np.sum(some['by_name']))} by name, the others as a drum that is blocked"
    if np.any(told):
        delays = 1e3 * some["delay_s"][told]
        words += (
            f", after {delays.min():.0f} to {delays.max():.0f} ms, median {np.median(delays):.0f}"
        )
    return words


def bias_figure(runs: Runs) -> Figure:
    """False alarms by threshold, and delays of what was told."""
    drawn, (left, right) = new_figure(1, 2, (12.0, 4.5), "Detectors of failures")
    some = runs(fails=NOTHING)
    if not len(some):
        raise MissingRuns(NOTHING)
    residuals = np.sort(1e3 * some["residual_m"])
    share = 1.0 - np.arange(len(residuals)) / len(residuals)
    left.step(residuals, share, where="post", color=nth_look(0).color, label="undisturbed runs")
    left.axvline(
        1e3 * limits()[0], color="black", linestyle="--", label="limit of a cable that pulled"
    )
    left.set(
        xlabel="residual of lengths held in a row [mm]", ylabel="share of runs that exceed it [-]",
        yscale="log", ylim=(0.5 / len(residuals), 1.5),
    )  # fmt: skip
    left.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    left.yaxis.set_minor_formatter(NullFormatter())
    left.legend(loc="best")
    for place, kind in enumerate(ALARMS):
        found = runs(fails=kind) if runs.has(fails=kind) else None
        if found is None or not np.any(found["told"]):
            right.plot([], [], color=nth_look(place).color, label=f"{kind}: none told")
            continue
        delays = np.sort(1e3 * found["delay_s"][found["told"].astype(bool)])
        look = nth_look(place)
        right.plot(
            delays, np.arange(1, len(delays) + 1) / len(found), look.marker or "o",
            linestyle="-", color=look.color, markerfacecolor="none", label=kind,
        )  # fmt: skip
    right.set(xlabel="delay [ms]", ylabel="share of failures told by then [-]", ylim=(0.0, 1.05))
    right.legend(loc="best")
    return drawn


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    quick = int(form.quick)
    return {
        "scenario": SCENARIO, "undisturbed": UNDISTURBED[quick], "breaks": BREAKS[quick],
        "others": OTHERS[quick], "times_s": TIMES, "after_s": AFTER, "in_time_s": IN_TIME,
        "turned": TURNED, "rate_hz": RATE,
        "durations_s": (SHORT, LONG), "every": EVERY, "schemes": SCHEMES,
        "methods": METHODS, "lowest_n": LOWEST,
        "largest": LARGEST, "drawn_by": SEED,
    }  # fmt: skip


STUDY = Study(
    name="detection",
    title="Detectors of failures: false alarms of undisturbed runs, what is missed, and delays",
    cases=cases,
    measure=measure,
    parameters=parameters,
    checks=(false_alarms, missed_breaks, missed_others),
    tables=[
        Summary(
            "Runs by what fails",
            ("fails",),
            {
                "runs": Cell("runs"),
                "told": Cell("total", "told"),
                "other cable first": Cell("total", "named"),
                "false alarms before": Cell("total", "false"),
                "largest residual [mm]": Cell("largest", "residual_m", ".2f"),
                "largest torque [N m]": Cell("largest", "torque_n_m", ".4f"),
                "largest lag [mm]": Cell("largest", "lag_m", ".2f"),
                "smallest reading [N]": Cell("smallest", "tension_n", ".2f"),
            },
        )
    ],
    figures={"detection": bias_figure},
)
