"""Studies: what ACROBOT does when a cable breaks, and whether detectors of failures can be trusted.

ACROBOT with its large platform moves under a visual servo by motor torques.

In the study `failure` one cable breaks at a time: every single cable, at several poses and speeds,
and every reaction of `runs.breaks`. If nobody knows, the controller goes on to ask the
broken cable for its part, and to its goal, so that its way counts as excursion, too. The robot
hangs: all exit points are above. At most poses seven of its cables hold it only if some of them may
go slack, or not at all; column `holds` says whether tensions from zero to the upper limit balance
the weight at the pose at which it broke. Boumann and Bruckmann (CableCon 2019) propose for such a
case to minimize kinetic energy, or to draw the platform by potential fields into the workspace that
is left, on a robot in a plane; `brake` and `retreat` are ours of that kind. Robotics 9(2):41 (2020)
is about tensions outside the wrench-feasible workspace, by the nearest corner; here those of the
nearest wrench are asked for. Of all three, and of Actuators 11(2):56 (2022), only abstracts were at
hand: no number of theirs is compared.

In the study `detection` all detectors of section `emergency` look and nobody reacts, from a pose
and at a speed, with a servo scheme, noise of sensors and wrong beliefs that are drawn for each run:
undisturbed, so that every alarm is a false one; with each cable that breaks; with every winch
blocked, every motor without power, every tension sensor and encoder frozen, the camera dark or with
its last image. No limit is fitted to these runs: those of lengths and torque follow from the noise
and constant errors of sensors, from static friction, from bounds of what is wrong with the believed
geometry, which are the largest that are drawn here, and from an accepted rate of false alarms; see
`estimation.break_detection` and `estimation.failure_watch`. Lag, dark and late have limits that
were chosen. A break counts as told when the right cable is named from then on until the run ends.
Cables that are wanted with less than `detectable_tension` are not certain to be told in time: a
constant error of their sensor may stand for what they pull.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from cdpr_drake.analyses.frame.figures import new_figure, plain_numbers
from cdpr_drake.analyses.runs.breaks import (
    BRAKE,
    NONE,
    RESTS,
    STOP,
    after_break,
)
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select, summary
from cdpr_drake.arrays import Array
from cdpr_drake.estimation.break_detection import detectable_tension
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.palette import nth_look
from cdpr_drake.sections.emergency.reactions import REACTIONS
from cdpr_drake.sections.emergency.section import silent_readings
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_broken_redistributed"

RATE = 500.0
"""Looks of detectors, and rows of the log, per second [Hz]."""


@cache
def start() -> Pose:
    """Of the scenario."""
    return load_scenario(SCENARIO).initial_pose


def _listed(numbers: Sequence[float] | Array) -> str:
    return "[" + ", ".join(f"{number:.6g}" for number in numbers) + "]"


# A cable breaks.

SHIFTS = ((0.0, 0.0, 0.0), (0.03, 0.03, 0.02), (-0.03, 0.03, 0.04), (0.03, -0.03, -0.02))
"""By how much the start is moved from that of the scenario [m]."""

BREAK_TIMES = (0.4, 1.0, 3.0)
"""When the cable breaks [s]: near the start, at full speed, and where the servo has arrived."""

BREAK_AFTER = 2.0
"""For how long a run goes on after that [s]."""

SAME = 1e-3
"""Excursions that differ by less are the same [m]."""


def break_cases(form: Form) -> Iterator[Case]:
    """All cables, starts, times and reactions; in the quick form two cables, one start and time."""
    cables = (0, 5) if form.quick else range(8)
    starts = [(0, BREAK_TIMES[1])] if form.quick else product(range(len(SHIFTS)), BREAK_TIMES)
    for (shift, time), cable, reaction in product(starts, cables, REACTIONS):
        keys = {"start": shift, "time_s": time, "cable": cable, "reaction": reaction}
        yield Case(keys=keys, call=partial(break_row, shift, time, cable, reaction))


def break_row(shift: int, time: float, cable: int, reaction: str) -> dict[str, Any]:
    """A run: its outcome, and what `after_break` says of it."""
    scenario = load_scenario(SCENARIO, [
        f"initial_pose.position={_listed(start().position + SHIFTS[shift])}",
        f"failures.events=[{{kind: cable_breaks, time: {time:g}, cable: {cable}}}]",
        f"emergency={REACTIONS[reaction]}", f"duration={time + BREAK_AFTER:g}",
        f"log_rate={RATE:g}", "integration.engine=compiled",
    ])  # fmt: skip
    run, robot = ServoRun(scenario).simulate(), load_robot(scenario.robot)
    numbers = after_break(run.log, robot, cable, time, scenario.cables.pulleys)
    return {"outcome": Outcome(run.outcome).name.lower(), **numbers}


def reaction_table(rows: Frame) -> Frame:
    """Runs by reaction."""
    return summary(rows, "reaction", {
        "runs": ("holds", "size"), "pose held by seven": ("holds", "sum"),
        "median excursion [mm]": ("excursion_m", "median"),
        "largest excursion [mm]": ("excursion_m", "max"),
        "largest speed [m/s]": ("largest_speed_m_s", "max"), "leave the frame": ("leaves", "sum"),
        "largest impact [m/s]": ("impact_m_s", "max"), "largest tension [N]": ("tension_n", "max"),
        "median time to rest [s]": ("rest_s", "median"),
    })  # fmt: skip


def excursion_table(rows: Frame) -> Frame:
    """Excursions of each reaction beside those without one, and beside those of stopping."""
    wide = rows.pivot(
        index=["start", "time_s", "cable", "holds"], columns="reaction", values="excursion_m"
    )
    lines = []
    for held, other in product((False, True), (NONE, STOP)):
        some = wide[wide.index.get_level_values("holds")] if held else wide
        for reaction in [name for name in REACTIONS if name in wide and name != other]:
            lines.append({
                "beside": other, "poses": "held by seven" if held else "all", "reaction": reaction,
                "less far": (some[reaction] < some[other]).sum(), "of": len(some),
                f"within {1e3 * SAME:g} mm": ((some[reaction] - some[other]).abs() < SAME).sum(),
                "median ratio": (some[reaction] / some[other]).median(),
            })  # fmt: skip
    return Frame(lines)


def break_figure(rows: Frame) -> Figure:
    """Largest excursion and speed by cable, a symbol for each reaction."""
    drawn, axes = new_figure(1, 2, (12.0, 5.0), "A cable breaks: what becomes of each reaction")
    for axis, column, factor, label in (
        (axes[0], "excursion_m", 1e3, "largest excursion [mm]"),
        (axes[1], "largest_speed_m_s", 1.0, "largest speed [m/s]"),
    ):
        for place, reaction in enumerate(REACTIONS):
            runs, look = rows[rows["reaction"] == reaction], nth_look(place)
            across = runs["cable"] + 1.0 + 0.1 * (place - 0.5 * (len(REACTIONS) - 1.0))
            axis.plot(
                across, factor * runs[column], look.marker or "o", color=look.color,
                markerfacecolor="none", label=reaction,
            )  # fmt: skip
        axis.set(xlabel="cable that breaks", ylabel=label, yscale="log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_minor_formatter(NullFormatter())
        plain_numbers(axis.yaxis)
    drawn.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(REACTIONS)
    )
    return drawn


FAILURE = Study(
    name="failure",
    title="A cable breaks: what stopping and redistribution are worth, cable by cable",
    cases=break_cases,
    parameters=lambda form: {
        "scenario": SCENARIO, "reactions": REACTIONS, "shifts_m": SHIFTS, "times_s": BREAK_TIMES,
        "after_s": BREAK_AFTER, "brake_s": BRAKE, "rests": RESTS, "same_m": SAME,
    },
    tables={
        "Runs by reaction": reaction_table,
        "Excursions beside those of another reaction": excursion_table,
    },
    figures={"failure": break_figure},
)  # fmt: skip


# Detectors.

NOTHING, BREAK, POWER, JAM = "nothing", "cable breaks", "power lost", "winch jams"

EVENT = "failures.events=[{{kind: %s, time: {time:g}, %s: {which}}}]"
FAULT = "camera.fault={{kind: %s, start: {time:g}, duration: 1000.0}}"
ALARMS = {
    BREAK: ("found_broken", EVENT % ("cable_breaks", "cable")),
    JAM: ("found_jammed", EVENT % ("winch_jams", "winch")),
    POWER: ("found_powerless", EVENT % ("power_lost", "winch")),
    "tension sensor freezes": (
        "frozen_tension",
        EVENT % ("sensor_freezes, sensor: tension", "cable"),
    ),
    "encoder freezes": ("frozen_encoder", EVENT % ("sensor_freezes, sensor: encoder", "cable")),
    "camera goes dark": ("camera_dark", FAULT % "dead"),
    "image stays": ("camera_late", FAULT % "frozen"),
}
"""By what fails, the column of the log that tells of it and the change of the scenario that it
is."""

UNDISTURBED, BREAKS, OTHERS = (1000, 4), (12, 1), (2, 1)
"""Undisturbed runs, and how often every cable breaks and every other failure comes, each from
another start; in the full form and in the quick one."""

SHORT, LONG, EVERY = 0.6, 3.0, 25
"""Durations of undisturbed runs [s], and how often one is long."""

TIMES = (0.3, 0.6, 1.2)
"""When something fails [s], in turn."""

IN_TIME, AFTER = 0.6, 1.5
"""Within which a break is to be told, and for how long a run goes on after a failure [s]."""

TURNED = 0.25
"""By how much a cable's direction may turn in that time, for the limit of its residual [-]."""

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


def alarm_cases(form: Form) -> Iterator[Case]:
    """All failures, then undisturbed runs."""
    runs = list[tuple[str, int, int]]()
    for fails, (_, change) in ALARMS.items():
        count = (2 if form.quick else 8) if "{which}" in change else 1
        repeats = range((BREAKS if fails == BREAK else OTHERS)[form.quick])
        runs += [
            (fails, which, 100_000 + 1000 * k + which) for k in repeats for which in range(count)
        ]
    runs += [(NOTHING, -1, number) for number in range(UNDISTURBED[form.quick])]
    for fails, which, number in runs:
        keys = {"fails": fails, "which": which, "number": number}
        yield Case(keys=keys, call=partial(alarm_row, fails, which, number))


def alarm_changes(fails: str, which: int, number: int) -> list[str]:
    """What differs from the scenario in a run."""
    drawn = np.random.default_rng([SEED, number])
    position = start().position + LARGEST["shift_m"] * drawn.uniform(-1.0, 1.0, 3)
    angles = start().angles_deg + LARGEST["turn_deg"] * drawn.uniform(-1.0, 1.0, 3)
    share = dict(zip(LARGEST, drawn.uniform(0.0, 1.0, len(LARGEST)), strict=True))
    most = {name: share[name] * LARGEST[name] for name in LARGEST}
    begins = fail_time(which, number)
    duration = begins + AFTER
    if fails == NOTHING:
        duration = LONG if number % EVERY == 0 else SHORT
    failure = [ALARMS[fails][1].format(time=begins, which=which)] if fails in ALARMS else []
    return [
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
        "emergency={reaction: stop, delay: 1000.0, known: found, watch: {}}",
        f"seed={number}", f"duration={duration:g}", f"log_rate={RATE:g}",
        "integration.engine=compiled", "camera.fault=null", "failures.events=[]", *failure,
    ]  # fmt: skip


def fail_time(which: int, number: int) -> float:
    """When something fails in a run [s]."""
    return TIMES[(number // 1000 + which) % len(TIMES)]


def alarm_row(fails: str, which: int, number: int) -> dict[str, Any]:
    """A run.

    Returns:
        outcome; time_s: how long it was; false: how many alarms there were before something failed,
        of all kinds; told: True if the right detector told of the right cable or device, or, of a
        motor without power, of a drum that is blocked; by_name: True if as what it is; delay_s: of
        a break until the right cable is named for good; first: what was told first after something
        failed; named: how many other cables were named after a break; carried_n: what the cable
        that broke pulled; detectable: True if that is enough to be told in time; residual_m: the
        largest residual of lengths that stayed in a row as long as an alarm needs, whether or not a
        tension was near nothing, too, torque_n_m and lag_m: the largest, before something failed;
        tension_n: the smallest reading before.
    """
    scenario = load_scenario(SCENARIO, alarm_changes(fails, which, number))
    run = ServoRun(scenario).simulate()
    log, times = run.log, run.log["time"]
    begins = np.inf if fails == NOTHING else fail_time(which, number)
    before = times < begins - 0.5 / RATE
    alarms = {kind: first_times(log[name], times) for kind, (name, _) in ALARMS.items()}
    false = {kind: int(np.sum(alarm < begins)) for kind, alarm in alarms.items()}
    after = {
        kind: float(np.min(alarm)) for kind, alarm in alarms.items()
        if begins <= np.min(alarm) < np.inf
    }  # fmt: skip
    moment = alarms[fails][which] if fails in alarms else np.inf
    carried, others = None, 0
    if fails == BREAK:
        flags = log[ALARMS[BREAK][0]]
        moment = named_for_good(flags[:, which], times)
        carried = float(log["tensions"][before][-1, which])
        others = int(np.sum(np.any(np.delete(flags[~before], which, axis=1) > 0.0, axis=0)))
    by_name = bool(begins <= moment < np.inf)
    if fails == POWER:  # a drum that friction holds is told as blocked: a winch has failed
        moment = min(moment, alarms[JAM][which])
    told = bool(begins <= moment < np.inf)
    assert scenario.emergency is not None
    return {
        "outcome": Outcome(run.outcome).name.lower(),
        "time_s": float(times[-1]),
        "false": sum(false.values()),
        "false_kinds": [kind for kind, count in false.items() if count],
        "told": told,
        "by_name": by_name,
        "delay_s": float(moment - begins) if told else None,
        "first": min(after, key=lambda kind: after[kind]) if after else "nothing",
        "named": others,
        "carried_n": carried,
        "detectable": carried is not None and carried >= limits()[1],
        "residual_m": held_in_a_row(log["break_residuals"][before], scenario.emergency.in_a_row),
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
    limit = settings.break_rule(len(robot.cables)).limit(TURNED)
    least = detectable_tension(
        limit, silent=float(np.max(silent_readings(scenario, settings, robot))),
        winding_per_newton=(1.0 + torque.proportional) / torque.derivative, within=IN_TIME,
    )  # fmt: skip
    return limit, least


def alarm_table(rows: Frame) -> Frame:
    """Runs by what fails."""
    return summary(rows, "fails", {
        "runs": ("told", "size"), "told": ("told", "sum"), "as what it is": ("by_name", "sum"),
        "least delay [ms]": ("delay_s", "min"), "median [ms]": ("delay_s", "median"),
        "largest [ms]": ("delay_s", "max"), "other cable first": ("named", "sum"),
        "false alarms before": ("false", "sum"), "in all [s]": ("time_s", "sum"),
        "largest residual [mm]": ("residual_m", "max"),
        "largest torque [N m]": ("torque_n_m", "max"), "largest lag [mm]": ("lag_m", "max"),
        "smallest reading [N]": ("tension_n", "min"),
    })  # fmt: skip


def alarm_figure(rows: Frame) -> Figure:
    """False alarms by threshold, and delays of what was told."""
    drawn, (left, right) = new_figure(1, 2, (12.0, 4.5), "Detectors of failures")
    residuals = np.sort(1e3 * select(rows, fails=NOTHING)["residual_m"])
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
        runs, look = rows[rows["fails"] == kind], nth_look(place)
        delays = np.sort(1e3 * runs["delay_s"].dropna().astype(float))
        right.plot(
            delays, np.arange(1, len(delays) + 1) / len(runs), look.marker or "o",
            linestyle="-", color=look.color, markerfacecolor="none",
            label=kind if len(delays) else f"{kind}: none told",
        )  # fmt: skip
    right.set(xlabel="delay [ms]", ylabel="share of failures told by then [-]", ylim=(0.0, 1.05))
    right.legend(loc="best")
    return drawn


DETECTION = Study(
    name="detection",
    title="Detectors of failures: false alarms of undisturbed runs, what is missed, and delays",
    cases=alarm_cases,
    parameters=lambda form: {
        "scenario": SCENARIO, "undisturbed": UNDISTURBED[form.quick], "breaks": BREAKS[form.quick],
        "others": OTHERS[form.quick], "times_s": TIMES, "after_s": AFTER, "in_time_s": IN_TIME,
        "turned": TURNED, "rate_hz": RATE, "durations_s": (SHORT, LONG), "every": EVERY,
        "schemes": SCHEMES, "methods": METHODS, "lowest_n": LOWEST, "largest": LARGEST,
        "drawn_by": SEED,
    },
    tables={"Runs by what fails": alarm_table},
    figures={"detection": alarm_figure},
)  # fmt: skip

STUDIES = {"failure": FAILURE, "detection": DETECTION}
