"""Pictures of a robot at rest: its cables, tensions and vibrations; what its file says that cables
and contacts do beside the elastic law."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, QhullError

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    bar_style,
    bare_figure,
    few_ticks,
    line_style,
    panels,
    styled,
)
from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    drum_tensions,
    loop_energy,
    strain_of_tension,
    tension_of_strain,
)
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.palette import BOUND, DOTTED, IDEAL, OUTLINE, PLATFORM, SOLID, nth_look

RobotAtRest: TypeAlias = Any
"""A `robot_at_rest.RobotAtRest`, which draws itself by this module and is not imported here."""

CURVE_POINTS = 40
"""Points of a drawn cable."""

FLAT = 0.2
"""A view is at least so high beside its width, and the other way round."""

POINTS = 201
"""Of a drawn curve."""

BEYOND = 1.6
"""How far curves go, over what there is at the pose."""

WAVE = 0.4
"""Strain of a drawn wave, over that at the pose."""

SWINGS = (0.7, 3.0)
"""Turns of drawn swings, over the turn at which contacts slip."""


def rest_figure(rest: RobotAtRest) -> Figure:
    """The cables from the side and from above, tensions, and natural frequencies."""
    vibrates = rest.frequencies is not None  # not with inextensible cables
    title = (
        f"{rest.robot.name} at rest, {rest.model} cables, {rest.geometry}\n"
        f"cables in the world frame W, tensions{', vibrations' * vibrates}"
    )
    figure = bare_figure((12.0, 9.5), title)
    mosaic: list[Any] = [["side", "above"], ["tensions", "modes" if vibrates else "tensions"]]
    with styled():
        axes = figure.subplot_mosaic(mosaic)
    _views(axes["side"], axes["above"], rest)
    place = axes["tensions"]
    for k, tension in enumerate(rest.tensions):
        place.bar(k, tension, **bar_style(nth_look(k)))
    place.set_xticks(np.arange(len(rest.names)), rest.names)
    place.set(ylabel="tension at the platform [N]")
    for bound in rest.robot.tension_limits():
        if 0.0 < bound <= 2.0 * np.max(rest.tensions, initial=1e-9):
            place.axhline(bound, label=f"bound {bound:g} N", **line_style(BOUND))
            place.legend(loc="upper right")
            place.margins(y=0.3)  # above the bars
    if rest.frequencies is not None:
        modes = np.arange(len(rest.frequencies)) + 1
        axes["modes"].bar(modes, rest.frequencies, color=PLATFORM.color)
        axes["modes"].set(xlabel="mode [-]", ylabel="natural frequency [Hz]", xticks=modes)
    return figure


def _views(side: Any, above: Any, rest: RobotAtRest) -> None:
    """Cables and platform in the planes of x and z, and of x and y."""
    curves = cable_curves(rest.cables, rest.model, rest.X_WP, rest.l0, CURVE_POINTS)
    anchors = rest.X_WP @ rest.cables.p_PB
    for place, (i, j), view in ((side, (0, 2), "from the side"), (above, (0, 1), "from above")):
        for k, curve in enumerate(curves):
            look = nth_look(k)
            dash = DOTTED if rest.slack[k] else SOLID
            place.plot(curve[i], curve[j], linestyle=dash, color=look.color)
            place.plot(curve[i, 0], curve[j, 0], look.marker, color=look.color, label=rest.names[k])
        outline = anchors[[i, j]]
        with suppress(QhullError):  # points on a line are drawn as they are
            around = ConvexHull(outline.T).vertices
            outline = outline[:, np.append(around, around[0])]
        place.plot(*outline, color=OUTLINE.color, linestyle=SOLID, linewidth=2.0)
        place.set_title(f"{view}; dotted: slack")
        _not_flat(place)
        place.set(xlabel=f"{'xyz'[i]} in W [m]", ylabel=f"{'xyz'[j]} in W [m]", aspect="equal")
    above.legend(**LEGEND_BESIDE)


def _not_flat(place: Any) -> None:
    """Room across a flat robot, for the numbers on that axis."""
    low, high = np.transpose([place.get_xlim(), place.get_ylim()])
    half = 0.5 * np.maximum(high - low, FLAT * np.max(high - low))
    middle = 0.5 * (low + high)
    place.set_xlim(middle[0] - half[0], middle[0] + half[0])
    place.set_ylim(middle[1] - half[1], middle[1] + half[1])
    few_ticks(place.xaxis)
    few_ticks(place.yaxis, 4)


def behaviour_figure(rest: RobotAtRest) -> Figure:
    """Force over elongation, tensions at the drums, moments of contacts: what the file says of.

    Raises:
        CableModelError: The file says nothing of them, or nothing that can be seen here.
    """
    robot = rest.robot
    behaviour, contacts = robot.cable_behaviour(), robot.contact_hysteresis()
    parts: list[Callable[[Any], None]] = []
    if behaviour.changes_lengths() or behaviour.creep_stiffness > 0.0:
        parts.append(partial(_elongation, rest=rest, behaviour=behaviour))
    if rest.drums is not None:
        parts.append(partial(_drums, rest=rest, behaviour=behaviour))
    if contacts is not None:
        parts.append(partial(_contacts, contacts=contacts))
    if not parts:
        rubs = behaviour.sheave_friction > 0.0
        what = "friction of sheaves alone, and no pulleys" if rubs else "elastic cables alone"
        raise CableModelError(
            f"behaviour of {robot.name}: found {what}; accepted: cable.behaviour or "
            "platform.hysteresis in its file"
        )
    title = f"{robot.name}: what cables and contacts do, by its file"
    rows, columns = -(-len(parts) // 2), min(len(parts), 2)
    figure, axes = panels(len(parts), 2, (5.2 * columns + 0.6, 4.6 * rows + 0.2), title)
    for each, draw in zip(axes, parts, strict=True):
        draw(each)
        each.legend(loc="best")
    return figure


def _elongation(axes: Any, rest: RobotAtRest, behaviour: CableBehaviour) -> None:
    """Tension over elongation of the cable with the largest tension at the pose."""
    k = int(np.argmax(rest.tensions))
    ES, t = rest.robot.stiffness()[k], float(rest.tensions[k])
    g, longer = behaviour.stiffening, behaviour.longer()
    at = float(strain_of_tension(np.array([t]), np.array([ES]), g)[0])
    e = np.linspace(0.0, BEYOND * max(at, t / ES), POINTS)

    def elongation(strain: Any) -> Any:  # over the length that the winch counts [%]
        return 100.0 * (longer * (1.0 + strain) - 1.0)

    laws = [f"stiffening {g:g} /N"] if g > 0.0 else []
    if behaviour.expansion * behaviour.warmer != 0.0:
        laws.append(f"warmer by {behaviour.warmer:g} K")
    axes.plot(100.0 * e, ES * e, label="elastic law", **line_style(IDEAL))
    law = tension_of_strain(e, np.full(POINTS, ES), g)
    near = law <= BEYOND * BEYOND * t
    words = " and ".join(laws) or "after long"
    axes.plot(elongation(e[near]), law[near], label=words, **line_style(nth_look(0)))
    axes.plot([elongation(at)], [t], "o", color="0.1", label=f"{rest.names[k]} at rest, {t:.3g} N")
    if behaviour.creep_stiffness > 0.0:
        tau, size = behaviour.creep_time, WAVE * at
        phase = np.linspace(0.0, 2.0 * np.pi, POINTS)
        wave = at + size * np.sin(phase)
        # A wave of pulsation 1 / tau, at which a loop is the largest.
        creeps = 0.5 * behaviour.creep_stiffness * ES * size * (np.sin(phase) + np.cos(phase))
        loop = tension_of_strain(wave, np.full(POINTS, ES), g) + creeps
        taken = loop_energy(size, 1.0 / tau, ES, behaviour)
        words = f"wave of {2.0 * np.pi * tau:.3g} s:\ncreep takes {taken:.3g} J/m each time"
        axes.fill(elongation(wave), loop, facecolor="0.85", edgecolor="none")
        axes.plot(elongation(wave), loop, label=words, **line_style(nth_look(1)))
    axes.set(
        xlabel="elongation of the counted length [%]", ylabel="tension [N]",
        title="force over elongation",
    )  # fmt: skip
    axes.set_ylim(bottom=0.0)


def _drums(axes: Any, rest: RobotAtRest, behaviour: CableBehaviour) -> None:
    """Tension at the drum over that at the platform, of the cable that wraps the farthest."""
    assert rest.drums is not None
    radii = np.where(rest.cables.pulley_radius > 0.0, rest.cables.pulley_radius, np.inf)
    wraps = cable_paths(rest.X_WP, rest.cables).arcs / radii
    k = int(np.argmax(wraps))
    t = np.linspace(0.0, BEYOND * float(np.max(rest.tensions)), POINTS)
    around = np.full(POINTS, wraps[k])
    up, down = (
        drum_tensions(t, around, behaviour.sheave_friction, np.full(POINTS, sign))
        for sign in (1.0, -1.0)
    )
    axes.fill_between(t, down, up, facecolor="0.85", label="standing: anything between")
    axes.plot(t, up, label="wound up, platform lifted", **line_style(nth_look(0)))
    axes.plot(t, t, label="without friction", **line_style(IDEAL))
    axes.plot(t, down, label="paid out, platform lowered", **line_style(nth_look(1)))
    at = [rest.tensions[k]] * 2
    axes.plot(at, rest.drums[:, k], "o", color="0.1", label=f"{rest.names[k]} at this pose")
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
