"""Figures 6.8 to 6.20 of the Gazebo thesis: a method's error and tensions, a row for each gain."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.tension_methods.experiments import THESIS_GAINS, UNCHECKED
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, nth_look

NUMBERS: dict[str, tuple[int, ...]] = {
    "linear_program": (8, 9, 10),
    "quadratic_program": (11, 12, 13, 14),
    "pseudo_inverse": (15, 16, 17),
    "closed_form": (18, 19, 20),
}
"""Numbers in chapter 6 of the figures, gain by gain."""

LARGEST: dict[str, tuple[float | None, ...]] = {
    "linear_program": (54.0, 456.0, 1224.0),
    "quadratic_program": (32.0, 110.0, 342.0, None),
    "pseudo_inverse": (117.0, 117.0, 117.0),
    "closed_form": (267.0, 385.0, 517.0),
}
"""Printed largest tension of each [N]. Source: Gazebo thesis 6.4.1 to 6.4.4."""


def gains_name(method: str) -> str:
    """Name of the file of a method's figure."""
    return f"gains_{method}"


def gains_figure(method: str, runs: Runs) -> Figure:
    """A method of the thesis, a row for each gain.

    Methods that leave the bounds are shown on the printed path with cables that push, which is
    the only way in which they can be followed along it; the others on the path moved inside.
    """
    wanted = "printed" if method in UNCHECKED else "thesis"
    shown = sorted(runs(experiment=wanted, method=method), key=lambda run: run["kp_per_s2"])
    gains = THESIS_GAINS[method]
    figure, grid = new_figure(
        len(shown), 2, (13.0, 1.6 + 3.4 * len(shown)),
        f"Gazebo thesis, figures 6.{NUMBERS[method][0]} to 6.{NUMBERS[method][-1]}: "
        f"{method.replace('_', ' ')}, position error and cable tensions by gain",
    )  # fmt: skip
    panels = np.reshape(np.array(grid, object), (len(shown), 2))
    for (left, right), run in zip(panels, shown, strict=True):
        place = gains.index(run["kp_per_s2"])
        words = f"6.{NUMBERS[method][place]}: Kp = Kd = {run['kp_per_s2']:g}"
        draw_curve(left, run["times_s"], 1e6 * run["errors_m"], nth_look(0))
        left.set(ylabel="position error [µm]", ylim=(0.0, None), title=words)
        robot = load_robot(run["robot"])
        for k, cable in enumerate(robot.cables):
            draw_curve(
                right, run["times_s"], run["tensions_n"][:, k], nth_look(k), cable.name,
                phase=phase_of(k, len(robot.cables)), linewidth=1.0, markersize=4.0,
            )  # fmt: skip
        right.axhline(robot.tension_limits()[0], label="lower bound", **line_style(BOUND))
        printed = LARGEST[method][place]
        said = f", printed {printed:g} N" if printed is not None else ""
        right.set(ylabel="tension [N]", title=f"largest {run['tension_max_n']:.1f} N{said}")
        for axes in (left, right):
            axes.set_xlim(0.0, run["wanted_duration_s"])
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.legend(*panels[0, 1].get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return figure
