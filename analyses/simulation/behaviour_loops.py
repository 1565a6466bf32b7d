"""What cables and contacts went through in a run: force over elongation, moment over turn.

Drawn for robots whose files say more than the elastic law. A loop that runs clockwise takes energy
out of the motion: its area.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, nth_look

_QUATERNION = [1, 2, 3, 0]
"""Of a pose's row, as scipy has them."""


def shows_loops(robot: Robot) -> bool:
    """Whether a robot's file says what loops come from."""
    behaviour = robot.cable_behaviour()
    stretches = behaviour.changes_lengths() or behaviour.creep_stiffness > 0.0
    return stretches or robot.contact_hysteresis() is not None


def loop_figure(title: str, robot: Robot, log: Log) -> Figure:
    """Tensions over elongations, and moments of contacts over turns, where the file has them.

    Args:
        title: Title.
        robot: The robot, which `shows_loops`.
        log: "tensions" [N], "lengths", "unstrained_lengths" [m], shape (n, m), "X_WP", (n, 7).
    """
    behaviour, contacts = robot.cable_behaviour(), robot.contact_hysteresis()
    drawn: list[Callable[[Any], None]] = []
    if behaviour.changes_lengths() or behaviour.creep_stiffness > 0.0:
        drawn.append(lambda axes: _elongations(axes, robot, log))
    if contacts is not None:
        drawn.append(lambda axes: _moments(axes, contacts, log))
    figure, panels = new_figure(1, len(drawn), (6.4 * len(drawn) + 0.6, 5.0), title)
    for axes, draw in zip(np.atleast_1d(panels), drawn, strict=True):
        draw(axes)
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize="small")
    return figure


def _elongations(axes: Any, robot: Robot, log: Log) -> None:
    strains = 100.0 * (log["lengths"] / log["unstrained_lengths"] - 1.0)
    for k, cable in enumerate(robot.cables):
        _draw(axes, strains[:, k], log["tensions"][:, k], k, cable.name)
    axes.set(
        xlabel="elongation of the counted length [%]", ylabel="tension at the platform [N]",
        title="cables; the mark is the beginning",
    )  # fmt: skip
    most = float(np.max(strains))
    if most > 0.0:  # how far slack cables are paid out would press the loops together
        axes.set_xlim(-0.1 * most, 1.05 * most)


def _moments(axes: Any, contacts: ContactHysteresis, log: Log) -> None:
    turns = Rotation.from_quat(log["X_WP"][:, _QUATERNION])
    moments = contacts.bent_along(turns) * contacts.stiffness()
    turned = np.degrees((turns[0].inv() * turns).as_rotvec())
    for k, axis in enumerate("xyz"):
        _draw(axes, turned[:, k], moments[:, k], k, f"about {axis} of P")
    tops = np.unique(contacts.held_moments())
    for top in tops[tops <= 2.0 * np.max(np.abs(moments), initial=0.0)]:
        style = line_style(BOUND) | {"linewidth": 1.0}
        axes.axhline(top, label=f"slips at {top:.3g} N m", **style)
        axes.axhline(-top, **style)
    axes.set(
        xlabel="turn from the beginning [deg]", ylabel="moment of the contacts [N m]",
        title="contacts at the platform; the mark is the beginning",
    )  # fmt: skip


def _draw(axes: Any, x: Any, y: Any, number: int, label: str) -> None:
    look = nth_look(number)
    rows = path_rows(np.column_stack([x, y]))
    axes.plot(x[rows], y[rows], label=label, linewidth=1.2, **line_style(look))
    axes.plot(x[:1], y[:1], look.marker, color=look.color, markersize=7)
