"""Figures of stability ranges: combinations as columns, like figures 3.1 to 3.4 of the thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import bar_style, line_style, new_figure
from cdpr_drake.analyses.studies.study import Frame, select
from cdpr_drake.palette import BOUND, IDEAL, OUTCOMES, PUBLISHED, VERDICTS, Look, nth_look

PLANAR_VISION = "3.2.1, planar: analyses I and II"
PLANAR_ROBOT = "3.2.1, planar: analysis III"
SPATIAL_VISION = "3.2.2, spatial: analysis I"
SPATIAL_CAMERA = "3.2.2, spatial: analysis II"
SPATIAL_ROBOT = "3.2.2, spatial: analysis III"
SINGLE = "3.4.2, one wrong parameter"
SECTIONS = (
    PLANAR_VISION, PLANAR_ROBOT, SPATIAL_VISION, SPATIAL_CAMERA, SPATIAL_ROBOT, SINGLE,
)  # fmt: skip
"""Sections of the servoing thesis."""

LARGEST = ("found_", "searched_")
ANSWERS = ("printed_", *LARGEST, "certified_", "sampled_")
"""Beginnings of columns that are no limits; a row has one column of `LARGEST` at most."""

LENGTHS = {
    "place": (r"$^b t_p$: $|x|, |y|$", "s"),
    "high": (r"height", "P"),
    "error": (r"$e$", "o"),
    "r_bp": (r"$\Delta\,^b t_p$", "D"),
    "r_s": (r"$\Delta e$", "v"),
    "r_pc": (r"$\Delta\,^p t_c$", "^"),
    "r_B": (r"$\Delta b_i$", "x"),
}
ANGLES = {
    "psi": (r"$\psi$, platform about z", "s"),
    "phi": (r"$\varphi$, $\theta$, about x and y", "o"),
    "d_theta_bp": (r"$\Delta\theta_{bp}$", "v"),
    "d_theta_pc": (r"$\Delta\theta_{pc}$", "^"),
}
"""Words and markers of limits."""

VARIED = {
    "place": "range of\nplaces", "error": "range of e", "r_pc": "camera", "r_bp": "platform",
    "r_B": "anchor points", "psi": "range of\nplaces", "psi tilt": "turn\nabout z",
    "height": "height",
}  # fmt: skip
"""What varies in a group of columns, by its name or the first word of it."""

READINGS = {
    "sampled_lower_corner_m3": "sampled, lower corner", "sampled_cubes_m3": "sampled, cubes",
    "sampled_no_turn_m3": "sampled, theta u = 0",
    "sampled_known_object_m3": "sampled, object known",
}  # fmt: skip
"""Words for other readings of one wrong parameter."""

LEAST_DRAWN_VOLUME, LEAST_DRAWN_LENGTH = 0.004, 1e-3
"""Smaller volumes [m^3] and lengths [m] are drawn as these, so that they can be seen."""

PRINTED_PLACE, PRINTED_TURN, PRINTED_TURN_ERROR = 1.5, 160.0, 90.0
"""Largest limits of figure 3.3 [m, deg]."""

Row = Mapping[str, Any]


def largest(row: Row) -> float:
    """The largest value that was sought."""
    values = (value for name, value in row.items() if name.startswith(LARGEST))
    return next(float(value) for value in values if not np.isnan(value))


def limit_words(row: Row) -> str:
    """Limits of a row in words; those that are zero are left out."""
    limits = (
        (*name.rpartition("_"), value) for name, value in row.items()
        if name.endswith(("_m", "_deg")) and not name.startswith(ANSWERS) and value > 0.0
    )  # fmt: skip
    return ", ".join(f"{name} {value:g} {unit}" for name, _, unit, value in limits)


def combination_figure(
    rows: Frame, section: str, title: str, width: float = 16.0, left_out: Sequence[str] = ()
) -> Figure:
    """Every combination as a column: its limits, and the largest that is stable, filled."""
    columns = select(rows, section=section)
    columns = columns[~columns["group"].isin(left_out)]
    combinations, groups = columns.to_dict("records"), columns["group"]
    figure, (top, bottom) = new_figure(
        2, 1, (width, 8.0), f"{title}. One combination in each column; filled: the largest found"
    )
    counted = np.arange(1, len(columns) + 1)
    x = counted + (groups != groups.shift()).cumsum().to_numpy() - 1.0  # a gap between groups
    sought = np.array([largest(row) for row in combinations])
    for axes, limits, unit, least, begin in (
        (top, LENGTHS, "m", LEAST_DRAWN_LENGTH, 0), (bottom, ANGLES, "deg", 0.0, len(LENGTHS)),
    ):  # fmt: skip
        for place in x:
            axes.axvline(place, color="0.88", lw=1.0, zorder=0)
        for number, (name, (label, marker)) in enumerate(limits.items(), start=begin):
            colour = nth_look(number).color
            limit = np.array([row.get(f"{name}_{unit}", np.nan) for row in combinations], float)
            filled = np.array([name in row["sought"].split(", ") for row in combinations])
            for shown, y, face, size in (
                (limit > 0.0, limit, "none", 6), (filled, sought, colour, 9),
            ):  # fmt: skip
                if np.any(shown):
                    axes.plot(
                        x[shown], np.maximum(y[shown], least), marker, ls="none", mfc=face,
                        mec=colour, ms=size, label=label,
                    )  # fmt: skip
        axes.set_xticks(x, counted, fontsize=8)
        axes.grid(visible=False, axis="x")
        axes.set_xlim(x[0] - 0.8, x[-1] + 0.8)
    printed = columns["printed_deg"].to_numpy(float)
    if np.any(printed > 0.0):
        bottom.plot(
            x, printed, "_", ls="none", color=PUBLISHED.color, ms=16, mew=2, label="published"
        )
    for axes in (top, bottom):
        handles, labels = axes.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        axes.legend(once.values(), once, loc="center left", bbox_to_anchor=(1.0, 0.5))
    names = groups.unique()
    for group in names if len(names) > 1 else ():
        first, *_, last = group.split() * 2
        words = VARIED.get(group) or VARIED[first]
        words += {"coarse": ",\nrest coarse", "well": ",\nrest well"}.get(last, "")
        top.text(
            float(np.mean(x[groups == group])), 1.02, words, fontsize=8, ha="center",
            transform=top.get_xaxis_transform(),
        )  # fmt: skip
    top.set(yscale="log", ylabel="lengths [m]")
    bottom.set(ylabel="angles [deg]", xlabel="combination")
    return figure


def object_figure(rows: Frame) -> Figure:
    """Spatial analysis I: largest error of the object's position over the rotations' limits."""
    places = select(rows, section=SPATIAL_VISION, group="place")
    turns = select(rows, section=SPATIAL_VISION, group="turn")
    figure, (left, right) = new_figure(
        1, 2, (15.0, 5.5), "Only the object's pose is wrong: what stays stable"
    )
    stable = places[places["found_m"] > 0.0]
    for number, (turn, curve) in enumerate(stable.groupby("theta_u_deg", sort=False)):
        look = nth_look(number)
        left.plot(
            curve["d_theta_s_deg"], curve["found_m"], marker=look.marker, label=f"{turn:g} deg",
            ms=4, **line_style(look),
        )  # fmt: skip
    left.axhline(PRINTED_PLACE, label="published maximum", **line_style(BOUND))
    left.set(
        xlabel="largest error of theta u [deg]", ylabel="largest error of the object's place [m]",
        ylim=(1.2, 2.05),
    )  # fmt: skip
    left.legend(title="theta up to", ncols=3, loc="lower left")
    for points, marker, look, words in (
        (stable, "o", OUTCOMES["converged"], "stable"),
        (places[places["found_m"] <= 0.0], "x", OUTCOMES["timeout"], "not stable"),
    ):
        right.plot(
            points["d_theta_s_deg"], points["theta_u_deg"], marker, color=look.color, ls="none",
            label=words,
        )  # fmt: skip
    right.plot(
        turns["d_theta_s_deg"], turns["found_deg"], "_", color=PUBLISHED.color, ms=14,
        label="largest theta found",
    )  # fmt: skip
    right.plot([0.0, 130.0], [180.0, 50.0], label="sum 180 deg", **line_style(IDEAL))
    right.axhline(PRINTED_TURN, label="published maxima", **line_style(BOUND))
    right.axvline(PRINTED_TURN_ERROR, **line_style(BOUND))
    right.set(
        xlabel="largest error of theta u [deg]", ylabel="largest theta [deg]", ylim=(-5.0, 185.0),
        yticks=range(0, 181, 30),
    )  # fmt: skip
    right.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def single_figure(rows: Frame) -> Figure:
    """3.4.2: published and found volumes, a group of bars for each wrong parameter."""
    looks = {
        "printed_m3": ("published", Look("#a0a0a0")),
        **{f"{verdict}_m3": (verdict, look) for verdict, look in VERDICTS.items()},
        **{
            column: (words, nth_look(len(VERDICTS) + k))
            for k, (column, words) in enumerate(READINGS.items())
        },
    }
    parameters = select(rows, section=SINGLE).to_dict("records")
    figure, axes = new_figure(1, 1, (9.5, 9.0), "ACROBOT, small platform: one wrong parameter")
    drawn: dict[str, Any] = {}
    for place, row in enumerate(parameters):
        bars = [name for name in looks if not np.isnan(row.get(name, np.nan))]
        size = 0.85 / len(bars)
        for number, name in enumerate(bars):
            y = place + size * (number - (len(bars) - 1) / 2.0)
            volume = max(row[name], LEAST_DRAWN_VOLUME)
            drawn[name] = axes.barh(y, volume, 0.9 * size, **bar_style(looks[name][1]))
    axes.set_yticks(range(len(parameters)), [limit_words(row) for row in parameters])
    axes.set(ylim=(len(parameters) - 0.5, -0.5), xlabel="workspace [m³]")
    legend = {looks[name][0]: drawn[name] for name in looks if name in drawn}
    figure.legend(legend.values(), legend, loc="outside lower center", ncols=3)
    return figure
