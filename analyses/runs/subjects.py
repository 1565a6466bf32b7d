"""Subjects of runs of robots: the numbers and the figures of each stand side by side.

A `Subject` row at the end of each lists them; see `Run.subjects`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    curves,
    draw_curve,
    line_style,
    new_figure,
    shade,
)
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.analyses.visualization.cable_figures import draw_cables
from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, DISTANCE, nth_look
from cdpr_drake.systems.diagrams.tension_management import used_gain
from cdpr_drake.systems.diagrams.torque_control import tension_limits
from cdpr_drake.systems.scenarios.run_settings import has_contact
from cdpr_drake.systems.worlds.settings import WorldSettings

CONTACT = "contact_force"
"""Force of contact on the platform in the log [N]."""


# The world around the robot


def world_names(world: WorldSettings | None) -> dict[str, list[str]]:
    """Names of the columns of quantities of the log that have a column for each body."""
    if world is None:
        return {}
    names = [f"{name}_m" for name in _bodies(world)]
    return {"clearance": names, "cable_clearance": names}


def _bodies(world: WorldSettings) -> list[str]:
    return [*(["ground"] if world.ground else []), *(body.name for body in world.obstacles)]


def world_numbers(run: Run) -> dict[str, Any] | None:
    """Clearances and contact; None without a world. Times count from row to row of the log."""
    world, log = run.scenario.world, run.log
    if world is None:
        return None
    names = _bodies(world)

    def least(clearances: Array) -> dict[str, float | None]:
        columns = [column[np.isfinite(column)] for column in clearances.T]
        lows = (float(np.min(column)) if len(column) else None for column in columns)
        return dict(zip(names, lows, strict=True))

    numbers: dict[str, Any] = {
        "bodies": names,
        "least_clearance_m": least(log["clearance"]),
        "final_clearance_m": dict(zip(names, log["clearance"][-1].tolist(), strict=True)),
        "least_cable_clearance_m": least(log["cable_clearance"]),
        "cables": "cables touch nothing: they pass through obstacles, and their clearance tells",
        "contact": None,
    }
    if has_contact(run.scenario):
        times, touches = log["time"], log["contact_count"][:, 0] > 0.0
        forces = np.linalg.norm(log[CONTACT], axis=1)
        numbers["contact"] = {
            "model": world.contact.model,
            "engine": "plant, since the compiled engine knows no contact",
            "first_s": float(times[np.argmax(touches)]) if np.any(touches) else None,
            "time_s": float(np.sum(np.diff(times) * touches[:-1])),
            "largest_force_n": float(np.max(forces)),
            "final_force_n": float(forces[-1]),
            "most_points": int(np.max(log["contact_count"])),
        }
    return numbers


def world_facts(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Labels and words for a terminal, from a summary."""
    world = summary["world"]
    if world is None:
        return []
    words = []
    for label, key in (("platform", "least_clearance_m"), ("cables", "least_cable_clearance_m")):
        gaps = {name: gap for name, gap in world[key].items() if gap is not None}
        if gaps:
            nearest = min(gaps, key=lambda name: gaps[name])
            words.append(f"{label} {1e3 * gaps[nearest]:.1f} mm from {nearest}")
    facts = [("least clearance", ", ".join(words) or "nothing to measure it from")]
    gaps = world["least_cable_clearance_m"]
    if crossed := [name for name, gap in gaps.items() if gap is not None and gap < 0.0]:
        facts.append(("cables", f"pass through {', '.join(crossed)}, without contact"))
    if (contact := world["contact"]) is not None:
        facts.append(("contact", "none" if contact["first_s"] is None else (
            f"from {contact['first_s']:.2f} s on, {contact['time_s']:.2f} s in all, at most "
            f"{contact['largest_force_n']:.1f} N"
        )))  # fmt: skip
    return facts


def world_figure(run: Run) -> Figure:
    """Clearances of platform and cables over time and, with contact, its force."""
    world, log, times = run.scenario.world, run.log, run.log["time"]
    names, touching = _bodies(world), CONTACT in log
    title = "Clearances of platform and cables" + (", and contact" if world.contact else "")
    figure, panels = new_figure(2 + touching, 1, (10.0, 6.5 + 3.0 * touching), run.title(title))
    for panel, quantity, words in (
        (panels[0], "clearance", "platform"), (panels[1], "cable_clearance", "cables")
    ):  # fmt: skip
        shown = [k for k in range(len(names)) if np.any(np.isfinite(log[quantity][:, k]))]
        labels = [names[k] for k in shown]
        curves(panel, times, log[quantity][:, shown], labels, numbers=shown, scale=1e3)
        panel.axhline(0.0, **line_style(BOUND))
        panel.set(xlabel="time [s]", ylabel=f"clearance of the {words} [mm]")
        panel.legend(**LEGEND_BESIDE)
    if touching:
        force = np.linalg.norm(log[CONTACT], axis=1)
        draw_curve(panels[2], times, force, DISTANCE, "force on the platform")
        shade(panels[2], times, log["contact_count"][:, 0] > 0.0, "in contact")
        panels[2].set(xlabel="time [s]", ylabel="contact force [N]", ylim=(0.0, None))
        panels[2].legend(**LEGEND_BESIDE)
    return figure


WORLD = Subject(
    "", figures={"world": world_figure}, applies=lambda run: run.scenario.world is not None
)


PROGRAM_STEPS = Subject(
    "program_steps",
    lambda run: run.built.blocks.distributor.step_times.as_dict(),
    applies=lambda run: run.built.blocks.distributor.step_times is not None,
)


# What breaks in a visual servo


def failure_numbers(run: Run) -> dict[str, Any]:
    """Failures, and how far the platform and the tensions went from the first failure on."""
    log, end = run.log, float(run.log["time"][-1])
    events = [event for event in run.scenario.failures.events if event.begins <= end]
    words = [event.words(run.robot) for event in events]
    numbers: dict[str, Any] = {
        "events": [
            {"kind": event.kind, "what": what, "time_s": event.begins}
            for event, what in zip(events, words, strict=True)
        ]
    }
    if not events:
        return numbers
    # A row holds the values before its instant: the row of the first failure is the last whole one.
    since = log["time"] >= min(event.begins for event in events)
    X_WP, tensions = log["X_WP"][since], log["tensions"][since]
    distance, angle = pose_rows_distance(X_WP, np.broadcast_to(X_WP[0], X_WP.shape))
    if "left_out" in log:
        acts = np.any(log["left_out"] > 0.0, axis=1)
        numbers["reacts_at_s"] = float(log["time"][np.argmax(acts)]) if np.any(acts) else None
    return numbers | {
        "largest_excursion_m": float(np.max(distance)),
        "largest_turn_rad": float(np.max(angle)),
        "largest_tension_n": float(np.max(tensions)),
    }


def gain_numbers(run: Run) -> dict[str, Any]:
    """Gain of a correction of tensions that states none: by length, and at the start."""
    gain = _gain(run)
    at_start = gain.each(run.log["lengths"][0])
    return {"per_length_1_per_ns": gain.share.tolist(), "at_start_m_per_ns": at_start.tolist()}


def _gain(run: Run) -> Any:
    scenario, settings = run.scenario, run.scenario.tension_management
    if settings is None:
        return None
    cables = scenario.cables.cable_set(run.robot)
    return used_gain(scenario, settings, run.robot, run.built.believed, cables)


TENSION_GAIN = Subject("tension_gain", gain_numbers, applies=lambda run: _gain(run) is not None)
FAILURES = Subject(
    "failures", failure_numbers, applies=lambda run: run.scenario.failures is not None
)


# Motors, goals of tensions, loops of cables and contacts


def motor_figure(run: Run) -> Figure:
    """Torques of the motors, and what friction takes of them."""
    log, friction = run.log, run.robot.winch_law().friction.static
    title = run.title("Torques of the motors and of their friction")
    figure, panels = new_figure(2, 1, (10.0, 7.5), title)
    for panel, name, quantity in (
        (panels[0], "motor", "applied_torques"), (panels[1], "friction", "friction_torques")
    ):  # fmt: skip
        draw_cables(panel, run.robot, log["time"], log[quantity])
        panel.set(xlabel="time [s]", ylabel=f"{name} torque [N m]")
    for sign, words in ((-1.0, None), (1.0, f"static friction\n{friction:g} N m")):
        panels[1].axhline(sign * friction, label=words, **line_style(BOUND))
    for panel in panels:
        panel.legend(**LEGEND_BESIDE)
    return figure


def tension_loop_figure(run: Run) -> Figure:
    """Goals of tensions between their limits, and the deviation of the true tensions.

    The times at which no tensions within the limits gave the wrench are shaded.
    """
    log, (low, high) = run.log, tension_limits(run.scenario, run.robot)
    title = run.title("Tensions that a servo by torque wants, and what there is beyond them")
    figure, panels = new_figure(2, 1, (10.0, 7.5), title)
    times, goals = log["time"][1:], log["wanted_tensions"][1:]  # before the first step: zeros
    draw_cables(panels[0], run.robot, times, goals)
    draw_cables(panels[1], run.robot, times, log["tensions"][1:] - goals)
    panels[0].axhline(low, label=f"lower limit {low:g} N", **line_style(BOUND))
    if high <= 1.5 * float(np.max(goals, initial=0.0)):
        panels[0].axhline(high, label=f"upper limit {high:g} N", **line_style(BOUND))
    labels = ("wanted tension [N]", "true - wanted tension [N]")
    for panel, label in zip(panels, labels, strict=True):
        shade(panel, times, log["relaxed"][1:, 0] > 0.0, "wrench infeasible")
        panel.set(xlabel="time [s]", ylabel=label)
        panel.legend(**LEGEND_BESIDE)
    return figure


def loop_figure(run: Run) -> Figure:
    """Tensions over elongations, and moments of contacts over turns, if the robot has them.

    A loop that runs clockwise takes energy out of the motion: its area.
    """
    drawings = []
    if _stretches(run.robot):
        drawings.append(_draw_elongations)
    if run.robot.contact_hysteresis() is not None:
        drawings.append(_draw_moments)
    title = run.title("What cables and contacts of the platform went through")
    figure, panels = new_figure(1, len(drawings), (6.4 * len(drawings) + 0.6, 5.0), title)
    for panel, draw in zip(np.atleast_1d(panels), drawings, strict=True):
        draw(panel, run)
        panel.legend(**LEGEND_BESIDE, fontsize="small")
    return figure


def _stretches(robot: Robot) -> bool:
    behaviour = robot.cable_behaviour()
    return behaviour.changes_lengths() or behaviour.creep_stiffness > 0.0


def _draw_elongations(panel: Any, run: Run) -> None:
    strains = 100.0 * (run.log["lengths"] / run.log["unstrained_lengths"] - 1.0)
    for k, cable in enumerate(run.robot.cables):
        _draw_loop(panel, strains[:, k], run.log["tensions"][:, k], k, cable.name)
    panel.set(
        xlabel="elongation of the counted length [%]", ylabel="tension at the platform [N]",
        title="cables; the mark is the beginning",
    )  # fmt: skip
    most = float(np.max(strains))
    if most > 0.0:  # slack cables, which are paid out far, would press the loops together
        panel.set_xlim(-0.1 * most, 1.05 * most)


def _draw_moments(panel: Any, run: Run) -> None:
    contacts: ContactHysteresis = run.robot.contact_hysteresis()
    turns = Rotation.from_quat(run.log["X_WP"][:, [1, 2, 3, 0]])
    moments = contacts.bent_along(turns) * contacts.stiffness()
    angles = np.degrees((turns[0].inv() * turns).as_rotvec())
    for k, axis in enumerate("xyz"):
        _draw_loop(panel, angles[:, k], moments[:, k], k, f"about {axis} of P")
    tops = np.unique(contacts.held_moments())
    for top in tops[tops <= 2.0 * np.max(np.abs(moments), initial=0.0)]:
        style = line_style(BOUND) | {"linewidth": 1.0}
        panel.axhline(top, label=f"slips at {top:.3g} N m", **style)
        panel.axhline(-top, **style)
    panel.set(
        xlabel="turn from the beginning [deg]", ylabel="moment of the contacts [N m]",
        title="contacts at the platform; the mark is the beginning",
    )  # fmt: skip


def _draw_loop(panel: Any, x: Array, y: Array, number: int, label: str) -> None:
    look, rows = nth_look(number), path_rows(np.column_stack([x, y]))
    panel.plot(x[rows], y[rows], label=label, linewidth=1.2, **line_style(look))
    panel.plot(x[:1], y[:1], look.marker, color=look.color, markersize=7)


MOTORS = Subject(
    "", figures={"motor_torques": motor_figure}, applies=lambda run: "applied_torques" in run.log
)
WANTED_TENSIONS = Subject(
    "",
    figures={"tension_loop": tension_loop_figure},
    applies=lambda run: "wanted_tensions" in run.log,
)
BEHAVIOUR = Subject(
    "",
    figures={"behaviour": loop_figure},
    applies=lambda run: _stretches(run.robot) or run.robot.contact_hysteresis() is not None,
)
