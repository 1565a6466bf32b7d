"""Figures of stability ranges: combinations as columns, like figures 3.1 to 3.4 of the thesis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.stability_ranges.question import (
    PLANAR_ROBOT,
    PLANAR_VISION,
    SINGLE,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
    found,
    limits_of,
    published,
)
from cdpr_drake.analyses.studies.stability_ranges.single_errors import (
    CUBES,
    FULL_VOLUME,
    KNOWN,
    LOWER_CORNER,
    NO_TURN,
    ROBOT,
)
from cdpr_drake.analyses.studies.stability_ranges.vision import PUBLISHED_OBJECT
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.palette import BOUND, IDEAL, OUTCOMES, PUBLISHED, VERDICTS, Look, nth_look

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

GROUPS = {
    (PLANAR_ROBOT, "place"): "range of places",
    (PLANAR_ROBOT, "error"): "range of e",
    (PLANAR_ROBOT, "r_pc"): "camera's\nplace",
    (PLANAR_ROBOT, "r_pc coarse"): "the same,\nrest coarse",
    (PLANAR_ROBOT, "r_B"): "anchor points",
    (PLANAR_ROBOT, "psi"): "range of places",
    (SPATIAL_ROBOT, "r_bp psi"): "platform,\ncoarse",
    (SPATIAL_ROBOT, "r_bp tilt"): "platform,\ncoarse",
    (SPATIAL_ROBOT, "r_pc psi"): "camera,\ncoarse",
    (SPATIAL_ROBOT, "r_pc tilt"): "camera,\ncoarse",
    (SPATIAL_ROBOT, "r_bp psi well"): "platform",
    (SPATIAL_ROBOT, "r_bp tilt well"): "platform",
    (SPATIAL_ROBOT, "r_pc psi well"): "camera",
    (SPATIAL_ROBOT, "r_pc tilt well"): "camera",
    (SPATIAL_ROBOT, "psi tilt"): "turn\nabout z",
    (SPATIAL_ROBOT, "place r_bp"): "range of\nplaces",
    (SPATIAL_ROBOT, "height r_bp"): "height",
    (SPATIAL_ROBOT, "place psi"): "range of\nplaces",
    (SPATIAL_ROBOT, "place tilt"): "range of\nplaces",
    (SPATIAL_ROBOT, "height tilt"): "height",
}
"""What varies in a group of columns."""

READINGS = {
    LOWER_CORNER: "sampled, lower corner", CUBES: "sampled, cubes",
    NO_TURN: "sampled, theta u = 0", KNOWN: "sampled, object known",
}  # fmt: skip
"""Words for other readings of one wrong parameter."""

LEAST_DRAWN_VOLUME = 0.004
"""An empty workspace is drawn as this, to be seen [m^3]."""

SMALLEST = 1e-3
"""Lengths below are drawn as this, on a logarithmic axis [m]."""


def combination_figure(
    runs: Runs, *, section: str, title: str, width: float = 16.0, left_out: tuple[str, ...] = ()
) -> Figure:
    """Every combination as a column: the limits given, and the largest that was found, filled."""
    rows = [run for run in runs(section=section) if run["group"] not in left_out]
    if not rows:
        raise MissingRuns(section)
    figure, (top, bottom) = new_figure(
        2, 1, (width, 8.0), f"{title}. One combination in each column; filled: the largest found"
    )
    places = _places(rows)
    for axes, words in ((top, LENGTHS), (bottom, ANGLES)):
        for x in places:
            axes.axvline(x, color="0.88", lw=1.0, zorder=0)
        for number, (name, (label, marker)) in enumerate(words.items()):
            given = [
                (x, limits_of(row)[name]) for x, row in zip(places, rows, strict=True)
                if name in limits_of(row)
            ]  # fmt: skip
            sought = [
                (x, found(row)) for x, row in zip(places, rows, strict=True)
                if name in row["sought"].split(", ")
            ]  # fmt: skip
            if not given and not sought:
                continue
            colour = nth_look(number + (len(LENGTHS) if axes is bottom else 0)).color
            for points, face, size in ((given, "none", 6), (sought, colour, 9)):
                if points:
                    x, y = np.array(points, float).T
                    axes.plot(
                        x, np.maximum(y, SMALLEST) if axes is top else y, marker, ls="none",
                        mfc=face, mec=colour, ms=size, label=label if points is points else None,
                    )  # fmt: skip
        _legend_once(axes)
        axes.set_xticks(places, [str(n + 1) for n in range(len(rows))], fontsize=8)
        axes.grid(visible=False, axis="x")
        axes.set_xlim(places[0] - 0.8, places[-1] + 0.8)
    known = [
        (x, limit) for x, row in zip(places, rows, strict=True)
        if (limit := published(row)) is not None
    ]  # fmt: skip
    if known:
        x, y = np.array(known, float).T
        bottom.plot(x, y, "_", color=PUBLISHED.color, ms=16, mew=2, label="published")
        _legend_once(bottom)
    _group_names(top, rows, places)
    top.set_yscale("log")
    top.set_ylabel("lengths [m]")
    bottom.set_ylabel("angles [deg]")
    bottom.set_xlabel("combination")
    return figure


def _places(rows: Sequence[Run]) -> list[float]:
    """Places of the columns, with a gap between groups."""
    places, at = [], 0.0
    for before, row in zip([rows[0], *rows], rows, strict=False):
        at += 1.0 if row["group"] == before["group"] else 2.0
        places.append(at)
    return places


def _group_names(axes: Axes, rows: Sequence[Run], places: Sequence[float]) -> None:
    groups = list(dict.fromkeys(row["group"] for row in rows))
    if len(groups) == 1:
        return
    for group in groups:
        mine = [x for x, row in zip(places, rows, strict=True) if row["group"] == group]
        axes.text(
            float(np.mean(mine)), 1.02, GROUPS.get((rows[0]["section"], group), group), fontsize=8,
            ha="center", transform=axes.get_xaxis_transform(),
        )  # fmt: skip


def _legend_once(axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(once.values(), once.keys(), loc="center left", bbox_to_anchor=(1.0, 0.5))


def object_figure(runs: Runs) -> Figure:
    """Spatial analysis I: largest error of the object's position over the rotations' limits."""
    some = runs(section=SPATIAL_VISION)
    figure, (left, right) = new_figure(
        1, 2, (15.0, 5.5), "Only the object's pose is wrong: what stays stable"
    )
    places = [run for run in some if run["group"] == "place"]
    for number, turn in enumerate(dict.fromkeys(run["theta_u_deg"] for run in places)):
        mine = [run for run in places if run["theta_u_deg"] == turn and found(run) > 0.0]
        mine_look = nth_look(number)
        left.plot(
            [run["d_theta_s_deg"] for run in mine], [found(run) for run in mine],
            marker=mine_look.marker, label=f"{turn:g} deg", ms=4, **line_style(mine_look),
        )  # fmt: skip
    left.axhline(PUBLISHED_OBJECT["place"], label="published maximum", **line_style(BOUND))
    left.set_xlabel("largest error of theta u [deg]")
    left.set_ylabel("largest error of the object's place [m]")
    left.set_ylim(1.2, 2.05)
    left.legend(title="theta up to", ncols=3, loc="lower left")
    for good, marker, words in ((True, "o", "stable"), (False, "x", "not stable")):
        mine = [run for run in places if (found(run) > 0.0) == good]
        right.plot(
            [run["d_theta_s_deg"] for run in mine], [run["theta_u_deg"] for run in mine],
            marker, color=OUTCOMES["converged" if good else "timeout"].color, ls="none",
            label=words,
        )  # fmt: skip
    limit = [run for run in some if run["group"] == "turn"]
    if limit:
        right.plot(
            [run["d_theta_s_deg"] for run in limit], [found(run) for run in limit], "_",
            color=PUBLISHED.color, ms=14, label="largest theta found",
        )  # fmt: skip
    right.plot([0.0, 100.0], [180.0, 80.0], label="sum 180 deg", **line_style(IDEAL))
    right.axhline(PUBLISHED_OBJECT["turn"], label="published maxima", **line_style(BOUND))
    right.axvline(PUBLISHED_OBJECT["turn_error"], **line_style(BOUND))
    right.set_xlabel("largest error of theta u [deg]")
    right.set_ylabel("largest theta [deg]")
    right.set_ylim(-5.0, 185.0)
    right.set_yticks(range(0, 181, 30))
    right.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def single_figure(runs: Runs) -> Figure:
    """3.4.2: published and found volumes, a group of bars for each wrong parameter."""
    rows = list(runs(section=SINGLE))
    figure, axes = new_figure(1, 1, (9.5, 9.0), f"One wrong parameter, {ROBOT}, PBVS")
    columns = {f"{verdict}_m3": (verdict, look) for verdict, look in VERDICTS.items()}
    names = {
        "published": ("published", Look("#a0a0a0")), **columns,
        **{
            column: (words, nth_look(len(VERDICTS) + k))
            for k, (column, words) in enumerate(READINGS.items())
        },
    }  # fmt: skip
    for place, row in enumerate(rows):
        volumes = {"published": published(row), **row.measured}
        mine = [name for name in names if volumes.get(name) is not None]
        size = 0.85 / len(mine)
        for number, name in enumerate(mine):
            y, volume = place + size * (number - (len(mine) - 1) / 2.0), volumes[name] or 0.0
            drawn = max(volume, LEAST_DRAWN_VOLUME)
            words, look = names[name]
            axes.barh(y, drawn, 0.9 * size, label=words, **bar_style(look))
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.set_yticks(range(len(rows)), [_single_words(row) for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("workspace [m³]")
    axes.set_xlim(0.0, 1.1 * FULL_VOLUME)
    order = [words for words, _ in names.values() if words in once]
    figure.legend([once[n] for n in order], order, loc="outside lower center", ncols=3)
    return figure


def _single_words(row: Run) -> str:
    ((name, value),) = limits_of(row).items()
    return f"{name} = {value:g} {'deg' if name.startswith('d_theta') else 'm'}"


FIGURES: dict[str, Callable[[Runs], Figure]] = {
    "ranges_planar_II": partial(
        combination_figure, section=PLANAR_VISION, title="Planar, camera and object wrong",
        width=11.0, left_out=("I",),
    ),
    "ranges_planar_III": partial(
        combination_figure, section=PLANAR_ROBOT, title="Planar robot, all errors",
        left_out=("camera", "area"),
    ),
    "ranges_spatial_I": object_figure,
    "ranges_spatial_III": partial(
        combination_figure, section=SPATIAL_ROBOT, title="ACROBOT, small platform, all errors",
    ),
    "single_errors": single_figure,
}  # fmt: skip
"""What draws the figures, by name."""
