"""A robot at rest as a picture."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, QhullError

from cdpr_drake.analyses.pictures import new_figure
from cdpr_drake.analyses.queries.static_query import StaticReport
from cdpr_drake.arrays import Array
from cdpr_drake.cables import cable_curves

CURVE_POINTS = 40
"""Points of a drawn cable."""


def static_figure(report: StaticReport, title: str) -> Figure:
    """The cables from the side and from above, tensions, and natural frequencies."""
    figure, axes = new_figure(2, 2, (12.0, 9.0), title)
    curves = cable_curves(report.cables, report.model, report.X_WP, report.l0, CURVE_POINTS)
    anchors = report.X_WP.rotation().matrix() @ report.cables.p_PB
    anchors = anchors + report.X_WP.translation()[:, np.newaxis]
    for place, (i, j), words, view in (
        (axes[0, 0], (0, 2), "xz", "from the side; dotted: slack"),
        (axes[0, 1], (0, 1), "xy", "from above"),
    ):
        for k, curve in enumerate(curves):
            slack = report.slack_lengths[k] > 0.0
            place.plot(curve[i], curve[j], ":" if slack else "-", color=f"C{k}")
            place.plot(curve[i, 0], curve[j, 0], "o", color=f"C{k}", label=report.names[k])
        outline = _outline(anchors[[i, j]])
        place.plot(*outline, color="0.2", linewidth=2.0)
        place.set_title(view)
        place.set(xlabel=f"{words[0]} [m]", ylabel=f"{words[1]} [m]", aspect="equal")
    axes[0, 1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    place = axes[1, 0]
    places = np.arange(len(report.l0))
    place.bar(places, report.tensions, color=[f"C{k}" for k in places])
    place.set_xticks(places, report.names)
    place.set(ylabel="tension at the platform [N]")
    low, high = report.bounds
    for bound in (low, high):
        if 0.0 < bound <= 2.0 * np.max(report.tensions, initial=1e-9):
            place.axhline(bound, color="C3", linestyle="--", label=f"bound {bound:g} N")
            place.legend()
    place = axes[1, 1]
    if report.frequencies is None:
        place.text(0.5, 0.5, "inextensible cables:\nno vibrations", ha="center", va="center")
        place.set_axis_off()
        return figure
    places = np.arange(len(report.frequencies)) + 1
    place.bar(places, report.frequencies, color="C0")
    place.set(xlabel="mode", ylabel="natural frequency [Hz]", xticks=places)
    return figure


def _outline(points: Array) -> Array:
    """Closed convex outline of points in a plane, shape (2, n); the points where there is none."""
    try:
        around = ConvexHull(points.T).vertices
    except QhullError:
        return points
    return points[:, np.append(around, around[0])]
