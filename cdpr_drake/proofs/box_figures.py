"""Boxes of poses by what is proven of them: shares, planes through them, solids of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from pydrake.geometry import Rgba

from cdpr_drake.analyses.frame.figures import line_style, new_figure, panels
from cdpr_drake.analyses.workspaces import workspace_figures
from cdpr_drake.analyses.workspaces.plane_panels import CORNERS
from cdpr_drake.analyses.workspaces.workspace_figures import LINE
from cdpr_drake.analyses.workspaces.workspace_scene import Layer, Mesh
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.proofs.certified_boxes import CertifiedBoxes

PROVEN = {
    INSIDE: ("proven inside", workspace_figures.INSIDE, None),
    OUTSIDE: ("proven outside", workspace_figures.OUTSIDE, None),
    OPEN: ("open", workspace_figures.SOME, "////"),
}
"""Label, colour and hatching of boxes by what is proven."""

EDGES: dict[str, Any] = {"edgecolor": "#555555", "linewidth": 0.1}
"""Of boxes."""

MOST_BOXES = 3000
"""So many boxes of each verdict are drawn, the largest."""

VERDICTS = {
    "inside": (INSIDE, Rgba(0.25, 0.56, 0.37, 0.35)),
    "outside": (OUTSIDE, Rgba(0.75, 0.35, 0.25, 0.25)),
    "open": (OPEN, Rgba(0.35, 0.35, 0.35, 0.6)),
}
"""Boxes by what is proven of them, and their colours."""


def boxes_figure(boxes: CertifiedBoxes, robot: str, cables: str = "") -> Figure:
    """Shares that are proven, and what is open, against the number of boxes, with the name of the
    robot and how its cables run in the title."""
    words = wrap(f"{robot}: boxes that are proven" + (f"; cables {cables}" if cables else ""), LINE)
    figure, axes = new_figure(
        1, 1, (7.0, 4.6), "\n".join(words) + f"\n{boxes.open:.2%} of the box open"
    )
    for number, (name, _, _) in enumerate(PROVEN.values()):
        look, share = nth_look(number), boxes.curve[:, number + 1]
        shown = share > 0.0  # on a logarithmic axis
        axes.plot(
            boxes.curve[shown, 0], 100.0 * share[shown], label=name, **line_style(look),
            marker=look.marker, markersize=4,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="boxes judged", ylabel="share of the box [%]")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def box_planes_figure(boxes: CertifiedBoxes, robot: str, kinds: Sequence[str]) -> Figure:
    """What is proven in three planes through the middle of the region that was cut.

    Angles that vary are in the middle of their ranges; the title has the robot's name and the kinds
    that were proven.
    """
    lower, upper = boxes.poses - boxes.halves, boxes.poses + boxes.halves
    low, high = np.min(lower, axis=0), np.max(upper, axis=0)
    middle = 0.5 * (low + high)
    wide = [k for k in range(3) if low[k] < high[k]]
    planes = [k for k in range(3) if len(set(wide) - {k}) == 2] or [2]
    words = wrap(f"{robot}: poses proven {', '.join(kinds)}", LINE)
    size = (1.0 + 3.6 * len(planes), 4.8)
    figure, grid = panels(len(planes), len(planes), size, "\n".join(words))
    # A pose of a border is in several boxes: a little off the middle, where no cut is.
    at = middle + 1e-6 * (high - low)
    for axes, normal in zip(grid, planes, strict=True):
        u, v = (k for k in range(3) if k != normal)
        others = [k for k in range(boxes.poses.shape[1]) if k not in (u, v)]
        hit = np.all(np.abs(boxes.poses - at)[:, others] <= boxes.halves[:, others] + 1e-12, axis=1)
        for verdict, (_, color, hatch) in PROVEN.items():
            numbers = np.flatnonzero(hit & (boxes.verdicts == verdict))
            sizes = 2.0 * boxes.halves[numbers][:, np.newaxis, (u, v)]
            cells = lower[numbers][:, np.newaxis, (u, v)] + sizes * CORNERS[:4]
            axes.add_collection(PolyCollection(cells, facecolor=color, hatch=hatch, **EDGES))
        axes.set(xlim=(low[u], high[u]), ylim=(low[v], high[v]), aspect="equal")
        axes.set(xlabel=f"{'xyz'[u]} [m]", ylabel=f"{'xyz'[v]} [m]")
        axes.grid(False)
        axes.set_title(f"{'xyz'[normal]} = {middle[normal]:.3g} m", fontsize=11)
    handles = [
        Patch(facecolor=color, edgecolor="#555555", hatch=hatch, label=label)
        for label, color, hatch in PROVEN.values()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def box_layers(boxes: CertifiedBoxes) -> list[Layer]:
    """Boxes by what is proven of them, the largest; a verdict without a box is left out."""
    sizes = np.ptp(np.concatenate([boxes.poses - boxes.halves, boxes.poses + boxes.halves]), axis=0)
    is_turned = np.any(sizes[3:] > 0.0)  # boxes of several orientations lie upon each other
    layers = []
    for name, (verdict, color) in VERDICTS.items():
        numbers = np.flatnonzero(boxes.verdicts == verdict)
        volumes = np.prod(np.where(boxes.halves > 0.0, boxes.halves, 1.0)[numbers], axis=1)
        largest = numbers[np.argsort(-volumes, kind="stable")[:MOST_BOXES]]
        if len(largest):
            proven = "nothing is proven" if name == "open" else f"proven {name}"
            title = f"{proven}, the largest {len(largest)} of {len(numbers)}"
            share = float(getattr(boxes, name))
            volume = "–" if is_turned else f"{share * np.prod(sizes[:3]):.4g} m^3"
            mesh = _cuboids(boxes.poses[largest, :3], boxes.halves[largest, :3])
            words = f"{100.0 * share:.2f} %"
            layers.append(Layer(f"boxes {name}", title, words, volume, mesh, color))
    return layers


def _cuboids(middles: Array, halves: Array) -> Mesh:
    """Vertices, shape (8 k, 3), and triangles, shape (12 k, 3), of boxes."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    corners = np.array([(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads])
    vertices = (middles[:, np.newaxis] + halves[:, np.newaxis] * signs).reshape(-1, 3)
    faces = corners + 8 * np.arange(len(middles))[:, np.newaxis, np.newaxis]
    return vertices, faces.reshape(-1, 3)
