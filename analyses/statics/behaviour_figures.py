"""What a robot file says that cables and platform do beside the elastic law, as a picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.statics.static_query import StaticReport
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    drum_tensions,
    loop_energy,
    strain_of_tension,
    tension_of_strain,
)
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, IDEAL, nth_look

POINTS = 201
"""Of a drawn curve."""

BEYOND = 1.6
"""How far curves go, over what there is at the pose."""

WAVE = 0.4
"""Strain of a drawn wave, over that at the pose."""

SWINGS = (0.7, 3.0)
"""Turns of drawn swings, over the turn at which contacts slip."""


def behaviour_figure(robot: Robot, report: StaticReport) -> Figure:
    """Force over elongation, tensions at the drums, moments of contacts: what the file says of.

    Args:
        robot: The robot.
        report: It at rest, whose tensions the picture is about.

    Raises:
        CableModelError: The file says nothing of them, or nothing that can be seen here.
    """
    behaviour, contacts = robot.cable_behaviour(), robot.contact_hysteresis()
    drawn: list[Callable[[Any], None]] = []
    if behaviour.changes_lengths() or behaviour.creep_stiffness > 0.0:
        drawn.append(lambda axes: _elongation(axes, robot, report, behaviour))
    if report.drums is not None:
        drawn.append(lambda axes: _drums(axes, report, behaviour))
    if contacts is not None:
        drawn.append(lambda axes: _contacts(axes, contacts))
    if not drawn:
        rubs = behaviour.sheave_friction > 0.0
        found = "friction of sheaves alone, and no pulleys" if rubs else "elastic cables alone"
        raise CableModelError(
            f"behaviour of {robot.name}: found {found}; accepted: cable.behaviour or "
            "platform.hysteresis in its file"
        )
    title = f"{robot.name}: what cables and contacts do, by its file"
    rows, columns = -(-len(drawn) // 2), min(len(drawn), 2)
    figure, panels = new_figure(rows, columns, (5.2 * columns + 0.6, 4.6 * rows + 0.2), title)
    places = np.atleast_1d(panels).ravel()
    for axes, draw in zip(places, drawn, strict=False):
        draw(axes)
        axes.legend(loc="best")
    for axes in places[len(drawn) :]:
        axes.remove()
    return figure


def _elongation(axes: Any, robot: Robot, report: StaticReport, behaviour: CableBehaviour) -> None:
    """Tension over elongation of the cable with the largest tension at the pose."""
    k = int(np.argmax(report.tensions))
    ES, t = robot.stiffness()[k], float(report.tensions[k])
    g, longer = behaviour.stiffening, behaviour.longer()
    at = float(strain_of_tension(np.array([t]), np.array([ES]), g)[0])
    e = np.linspace(0.0, BEYOND * max(at, t / ES), POINTS)

    def seen(strain: Any) -> Any:
        """Elongation over the length that the winch counts [%]."""
        return 100.0 * (longer * (1.0 + strain) - 1.0)

    axes.plot(100.0 * e, ES * e, label="elastic law", **line_style(IDEAL))
    law = tension_of_strain(e, np.full(POINTS, ES), g)
    kept = law <= BEYOND * BEYOND * t
    axes.plot(seen(e[kept]), law[kept], label=_law_words(behaviour), **line_style(nth_look(0)))
    axes.plot([seen(at)], [t], "o", color="0.1", label=f"{report.names[k]} at rest, {t:.3g} N")
    if behaviour.creep_stiffness > 0.0:
        tau, size = behaviour.creep_time, WAVE * at
        phase = np.linspace(0.0, 2.0 * np.pi, POINTS)
        wave = at + size * np.sin(phase)
        # A wave of pulsation 1 / tau, at which a loop is the largest.
        creeps = 0.5 * behaviour.creep_stiffness * ES * size * (np.sin(phase) + np.cos(phase))
        loop = tension_of_strain(wave, np.full(POINTS, ES), g) + creeps
        taken = loop_energy(size, 1.0 / tau, ES, behaviour)
        words = f"wave of {2.0 * np.pi * tau:.3g} s:\ncreep takes {taken:.3g} J/m each time"
        axes.fill(seen(wave), loop, facecolor="0.85", edgecolor="none")
        axes.plot(seen(wave), loop, label=words, **line_style(nth_look(1)))
    axes.set(
        xlabel="elongation of the counted length [%]", ylabel="tension [N]",
        title="force over elongation",
    )  # fmt: skip
    axes.set_ylim(bottom=0.0)


def _law_words(behaviour: CableBehaviour) -> str:
    said = []
    if behaviour.stiffening > 0.0:
        said.append(f"stiffening {behaviour.stiffening:g} /N")
    if behaviour.expansion * behaviour.warmer != 0.0:
        said.append(f"warmer by {behaviour.warmer:g} K")
    return " and ".join(said) or "after long"


def _drums(axes: Any, report: StaticReport, behaviour: CableBehaviour) -> None:
    """Tension at the drum over that at the platform, of the cable that wraps the farthest."""
    radii = np.where(report.cables.pulley_radius > 0.0, report.cables.pulley_radius, np.inf)
    wraps = cable_paths(report.X_WP, report.cables).arcs / radii
    k = int(np.argmax(wraps))
    t = np.linspace(0.0, BEYOND * float(np.max(report.tensions)), POINTS)
    up, down = (
        drum_tensions(
            t, np.full(POINTS, wraps[k]), behaviour.sheave_friction, sign * np.ones(POINTS)
        )
        for sign in (1.0, -1.0)
    )
    axes.fill_between(t, down, up, facecolor="0.85", label="standing: anything between")
    axes.plot(t, up, label="wound up, platform lifted", **line_style(nth_look(0)))
    axes.plot(t, t, label="without friction", **line_style(IDEAL))
    axes.plot(t, down, label="paid out, platform lowered", **line_style(nth_look(1)))
    assert report.drums is not None
    at = [report.tensions[k]] * 2
    axes.plot(at, report.drums[:, k], "o", color="0.1", label=f"{report.names[k]} at this pose")
    axes.set(
        xlabel="tension at the platform [N]", ylabel="tension at the drum [N]",
        title=f"sheave, wrap {np.degrees(wraps[k]):.0f} deg",
    )  # fmt: skip


def _contacts(axes: Any, contacts: ContactHysteresis) -> None:
    """Moments against turns, in swings below and beyond the turn at which contacts slip."""
    number = 0
    for words, stiffness in (("tilt", contacts.tilt), ("turn", contacts.turn)):
        if stiffness == 0.0:
            continue
        for share in SWINGS:
            amplitude = share * contacts.slip
            s = np.linspace(-amplitude, amplitude, POINTS)
            up, back = contacts.loop(s, amplitude, stiffness)
            taken = contacts.loop_energy(amplitude, stiffness)
            turns, moments = np.append(s, s[::-1]), np.append(up, back[::-1])
            axes.plot(
                np.degrees(turns), moments, label=f"{words}: takes {taken:.3g} J a swing",
                **line_style(nth_look(number)),
            )  # fmt: skip
            number += 1
    top = float(np.max(contacts.held_moments()))
    for side in (top, -top):
        label = f"slips at {top:.3g} N m" if side > 0.0 else None
        axes.axhline(side, label=label, **line_style(BOUND) | {"linewidth": 1.0})
    axes.set(
        xlabel="turn from the middle of a swing [deg]", ylabel="moment of the contacts [N m]",
        title="contacts at the platform",
    )  # fmt: skip
    axes.set_ylim(-1.15 * top, 2.1 * top)  # room for the legend
