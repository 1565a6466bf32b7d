"""Study: what a cable robot does when a cable breaks, and what reactions are worth.

ACROBOT with its large platform moves under a visual servo by motor torques; at a time one cable
breaks. Every single cable, at several poses and speeds, and every reaction:

* none: nobody knows, and the controller goes on to ask the broken cable for its part, and to its
  goal, so that its way counts as excursion, too;
* stop: brakes of all winches close, told at once, `BRAKE` later;
* redistribute: the cables that are left are asked to hold the platform where it is, told at once;
* found: as redistribute, when lengths and tensions have told;
* continue: as redistribute, but on to the goal;
* brake: only motion is to end, with least kinetic energy, wherever that is, told at once;
* retreat: to the nearest pose that the cables left hold, told at once;
* descend: straight down to the ground, told at once.

The robot hangs: all exit points are above. At most poses seven of its cables hold it only if some
of them may go slack, or not at all; column `holds` says whether tensions from zero to the upper
limit balance the weight at the pose where it broke.

Boumann and Bruckmann (CableCon 2019) propose for such a case to minimize kinetic energy, or to draw
the platform by potential fields into the workspace that is left, on a robot in a plane; `brake` and
`retreat` are ours of that kind. Robotics 9(2):41 (2020) is about tensions outside the
wrench-feasible workspace, by the nearest corner; here those of the nearest wrench are asked for.
Of all three, and of Actuators 11(2):56 (2022), only abstracts were at hand: no number of theirs is
compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from cdpr_drake.analyses.simulation.break_report import (
    BRAKE,
    BRAKING,
    FOUND,
    NONE,
    REACTIONS,
    REDISTRIBUTE,
    RESTS,
    RETREAT,
    STOP,
    after_break,
)
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure, plain_numbers
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_broken_redistributed"

ACTUATORS = "Boumann, Bruckmann, Actuators 11(2):56 (2022), abstract"

SHIFTS = ((0.0, 0.0, 0.0), (0.03, 0.03, 0.02), (-0.03, 0.03, 0.04), (0.03, -0.03, -0.02))
"""By how much the start is moved from that of the scenario [m]."""

TIMES = (0.4, 1.0, 3.0)
"""When the cable breaks [s]: near the start, at full speed, and where the servo has arrived."""

AFTER = 2.0
"""For how long a run goes on after that [s]."""

QUICK = (0, 5)
"""Cables of the quick form, with the first shift and the second time."""

RATE = 500.0
"""Rows of the log per second [Hz]."""

SAME = 1e-3
"""Excursions that differ by less are the same [m]."""


def cases(form: Form) -> Iterator[Case]:
    """All cables, states and reactions."""
    count = len(load_robot(load_scenario(SCENARIO).robot).cables)
    states = [(0, 1)] if form.quick else product(range(len(SHIFTS)), range(len(TIMES)))
    for shift, time in states:
        for cable in QUICK if form.quick else range(count):
            for reaction in REACTIONS:
                keys = {"start": shift, "time_s": TIMES[time], "cable": cable, "reaction": reaction}
                name = f"start {shift} at {TIMES[time]:g} cable {cable} {reaction}"
                yield Case(name=name, keys=keys)


def overrides(keys: Mapping[str, Any]) -> list[str]:
    """What differs from the scenario in a run."""
    time = keys["time_s"]
    position = load_scenario(SCENARIO).initial_pose.position + SHIFTS[keys["start"]]
    return [
        "initial_pose.position=[" + ", ".join(f"{x:g}" for x in position) + "]",
        f"failures.events=[{{kind: cable_breaks, time: {time:g}, cable: {keys['cable']}}}]",
        f"emergency={REACTIONS[keys['reaction']]}",
        f"duration={time + AFTER:g}", f"log_rate={RATE:g}", "integration.engine=compiled",
    ]  # fmt: skip


def measure(case: Case, _seed: int) -> dict[str, Any]:
    """A run.

    Returns:
        outcome, and what `after_break` says.
    """
    scenario = load_scenario(SCENARIO, overrides(case.keys))
    run = run_scenario(scenario)
    told = after_break(
        run.log, load_robot(scenario.robot), case.keys["cable"], case.keys["time_s"],
        scenario.cables.pulleys,
    )  # fmt: skip
    return {"outcome": Outcome(run.outcome).name.lower(), **told}


def beside(runs: Runs, one: str, other: str) -> tuple[list[bool], float, str]:
    """Of each cable and state, whether a reaction goes less far than another, median ratio, words.

    Raises:
        MissingRuns: There are none of both.
    """
    better, ratios, same = [], [], 0
    for _, some in runs.by("start", "time_s", "cable"):
        pair = [some(reaction=reaction) for reaction in (one, other)]
        if not all(len(each) for each in pair):
            continue
        a, b = (float(each["excursion_m"][0]) for each in pair)
        same += abs(a - b) < SAME
        better.append(a < b)
        ratios.append(a / b)
    if not better:
        raise MissingRuns(f"{one} and {other}")
    words = (
        f"less far in {sum(better)} of {len(better)} cases, {same} of them within "
        f"{1e3 * SAME:g} mm of each other; median ratio of excursions {np.median(ratios):.2f}"
    )
    return better, float(np.median(ratios)), words


@statement("Stopping all winches keeps the platform nearer than going on.", basis=OURS)
def stopping(runs: Runs) -> Finding:
    """Stop beside nothing."""
    better, _, words = beside(runs, STOP, NONE)
    return Finding(found=words, held=better)


@statement("Redistribution goes less far than stopping.", basis=OURS)
def redistribution(runs: Runs) -> Finding:
    """Redistribute beside stop, and where seven cables hold the pose."""
    better, _, words = beside(runs, REDISTRIBUTE, STOP)
    held = runs(holds=True)
    apart = "; seven cables hold none of the poses"
    if len(held):
        apart = f"; where seven cables hold the pose: {beside(held, REDISTRIBUTE, STOP)[2]}"
    return Finding(
        found=words + apart,
        held=better,
        why="A robot that hangs has few poses that seven cables hold. Where they do not, the "
        "controller asks for a pose that cannot be held, and the platform goes where the nearest "
        "wrench takes it; drums that stand still hold it on cables of constant length.",
    )


@statement("No reaction goes farther than none.", basis=OURS)
def worse(runs: Runs) -> Finding:
    """Every reaction beside nothing, with those named that are worse."""
    held, words = [], []
    for reaction in (STOP, REDISTRIBUTE, FOUND, BRAKING, RETREAT):
        better, ratio, _ = beside(runs, reaction, NONE)
        held += better
        words.append(f"{reaction}: farther in {better.count(False)} of {len(better)} ({ratio:.2f})")
    return Finding(found="; ".join(words), held=held)


@statement("No reaction goes farther than stopping.", basis=OURS)
def worse_than_stop(runs: Runs) -> Finding:
    """Every reaction that holds, brakes or retreats beside stopping, with those that are worse."""
    held, words = [], []
    for reaction in (REDISTRIBUTE, FOUND, BRAKING, RETREAT):
        better, ratio, _ = beside(runs, reaction, STOP)
        held += better
        words.append(f"{reaction}: farther in {better.count(False)} of {len(better)} ({ratio:.2f})")
    return Finding(
        found="; ".join(words) + "; continue and descend are to go away, and are left out",
        held=held,
    )


@statement("Braking leaves less speed than holding the place.", basis=OURS)
def least_energy(runs: Runs) -> Finding:
    """Largest speed under `brake` beside that under `redistribute`, after the same break."""
    less, same = [], 0
    for _, some in runs.by("start", "time_s", "cable"):
        pair = [some(reaction=reaction) for reaction in (BRAKING, REDISTRIBUTE)]
        if all(len(each) for each in pair):
            a, b = (float(each["largest_speed_m_s"][0]) for each in pair)
            less.append(a <= b)
            same += a == b
    if not less:
        raise MissingRuns(BRAKING)
    return Finding(
        found=f"not more in {sum(less)} of {len(less)} cases, the same in {same}", held=less
    )


@statement(
    "Cables that remain can keep a platform from collisions, with the ground for one.",
    source=ACTUATORS,
    cause=SOURCE,
    why="Only the abstract was at hand: where the cable broke, and from which motion, is not told.",
)
def no_collision(runs: Runs) -> Finding:
    """Whether an anchor point left the frame or went into the ground with reactions to a break."""
    kept, words = [], []
    for reaction in (REDISTRIBUTE, BRAKING, RETREAT):
        some = runs(reaction=reaction)
        kept += [not out for out in some["leaves"]]
        words.append(f"{reaction}: {some.total('leaves')} of {len(some)} leave the frame")
    nobody = runs(reaction=NONE)
    words.append(f"{NONE}: {nobody.total('leaves')} of {len(nobody)}")
    return Finding(found="; ".join(words), held=kept)


def figure(runs: Runs) -> Figure:
    """Largest excursion and speed by cable, a symbol for each reaction."""
    drawn, axes = new_figure(1, 2, (12.0, 5.0), "A cable breaks: what becomes of each reaction")
    for place, reaction in enumerate(REACTIONS):
        some, look = runs(reaction=reaction), nth_look(place)
        if not len(some):
            continue
        across = some["cable"] + 1.0 + 0.1 * (place - 0.5 * (len(REACTIONS) - 1.0))
        for axis, column, factor in zip(
            axes, ("excursion_m", "largest_speed_m_s"), (1e3, 1.0), strict=True
        ):
            axis.plot(
                across, factor * some[column], look.marker or "o", color=look.color,
                markerfacecolor="none", label=reaction,
            )  # fmt: skip
    axes[0].set(ylabel="largest excursion [mm]")
    axes[1].set(ylabel="largest speed [m/s]")
    for axis in axes:
        axis.set(xlabel="cable that breaks", yscale="log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_minor_formatter(NullFormatter())
        plain_numbers(axis.yaxis)
    handles, names = axes[0].get_legend_handles_labels()
    drawn.legend(handles, names, loc="outside lower center", ncols=len(REACTIONS))
    return drawn


def parameters(_form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    return {
        "scenario": SCENARIO, "reactions": REACTIONS, "shifts_m": SHIFTS, "times_s": TIMES,
        "after_s": AFTER, "brake_s": BRAKE, "rests": RESTS, "same_m": SAME,
    }  # fmt: skip


STUDY = Study(
    name="failure",
    title="A cable breaks: what stopping and redistribution are worth, cable by cable",
    cases=cases,
    measure=measure,
    parameters=parameters,
    checks=(stopping, redistribution, worse, worse_than_stop, least_energy, no_collision),
    tables=[
        Summary(
            "Runs by reaction",
            ("reaction",),
            {
                "runs": Cell("runs"),
                "pose held by seven": Cell("total", "holds"),
                "median excursion [mm]": Cell("median", "excursion_m", ".1f"),
                "largest excursion [mm]": Cell("largest", "excursion_m", ".1f"),
                "largest speed [m/s]": Cell("largest", "largest_speed_m_s", ".2f"),
                "leave the frame": Cell("total", "leaves"),
                "largest impact [m/s]": Cell("largest", "impact_m_s", ".2f"),
                "largest tension [N]": Cell("largest", "tension_n", ".1f"),
                "median time to rest [s]": Cell("median", "rest_s", ".2f"),
            },
        )
    ],
    figures={"failure": figure},
)
