"""Study: pixels as the servoing thesis prints them, beside ours in images of four widths.

The thesis prints deviations in the image in pixels, but not how wide the streamed image was. Runs
of its case studies give each deviation in a width; rows that suggested an image half as wide as the
sensor are apart from those that did not.

Source: servoing thesis 2.3, 4.3, 4.4, 5.3.2, tables A.2, A.3, A.5.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.simulation.run_summary import THESIS_WIDTH
from cdpr_drake.analyses.studies.catalogue import STUDIES as CATALOGUE
from cdpr_drake.analyses.studies.framework.case_run import measure_run
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import CHOICE, OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure, plain_numbers
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.systems.cameras.camera_settings import PROJECTED

WIDTHS = (1600, 1280, 800, 640)
"""Widths of an image [px]: IDS sensor (table A.3), webcam (A.2), half of the IDS sensor, webcam and
Astra (A.2, A.5)."""

OWN_WIDTH = 640
"""Width of the scenarios' camera [px], which has the noise of its corners."""

HALF = 800
"""Width that was suggested [px]."""

SUGGESTING, HELD_OUT = "suggesting", "held out"
"""Groups of rows: those that suggested another width, and all others."""

ABOUT, MOST, LEAST = "about", "at most", "at least"
"""How a number is printed."""

FITS = 1.5
"""A width fits a group of rows if the median ratio of ours to the printed numbers is within this
factor of 1: half of the factor 2 between 1600 and 800 px, by the logarithm, is 1.41."""

INFORMATIVE = 0.5
"""An upper bound that is kept with less of it than this share says little: any small number is."""

SCALES = 0.05
"""How far a deviation at a width may be from that in proportion [-]: a fifth of the least step
between two widths, 25 %, so that it cannot pass for another width."""

LENGTHS = ("4", "5", "6", "7")
"""Estimators of case study I by cable lengths."""


@dataclass(frozen=True)
class PrintedPixels:
    """A deviation in the image that the thesis prints.

    Attributes:
        label: Words for it.
        source: Its section.
        group: `SUGGESTING` or `HELD_OUT`.
        kind: `ABOUT`, `MOST` or `LEAST`.
        printed: The number [px].
        study: Case study here.
        configurations: Its configurations of which it is printed; of several the one counts that
            comes nearest to violating the bound.
    """

    label: str
    source: str
    group: str
    kind: str
    printed: float
    study: str
    configurations: tuple[str, ...]

    def ours(self, runs: Runs) -> float:
        """Ours in an image of `THESIS_WIDTH` [px].

        Raises:
            MissingRuns: There are no runs of it.
        """
        means = [
            runs.mean("deviation_1600_px", study=self.study, configuration=name, width=OWN_WIDTH)
            for name in self.configurations
        ]
        return float(min(means) if self.kind == LEAST else max(means))

    def ratio(self, runs: Runs, width: int) -> float:
        """Ours in an image of a width over the printed number."""
        return self.ours(runs) * width / THESIS_WIDTH / self.printed


def _row(
    label: str, source: str, group: str, kind: str, printed: float, study: str, *names: str
) -> PrintedPixels:
    return PrintedPixels(label, source, group, kind, printed, study, names)


ROWS = (
    _row("d1, tracking", "4.3.2", SUGGESTING, ABOUT, 18.0, "case-7", "d1_tracking"),
    _row("d3, tracking", "4.3.2", SUGGESTING, ABOUT, 18.0, "case-7", "d3_tracking"),
    _row("d4, tracking", "4.3.2", SUGGESTING, ABOUT, 18.0, "case-7", "d4_tracking"),
    _row("E7, 6 cm", "5.3.2", SUGGESTING, ABOUT, 80.0, "case-10", "E7"),
    _row("E8, 6 cm, corrected", "5.3.2", SUGGESTING, ABOUT, 35.0, "case-10", "E8"),
    _row("E10, 8 cm, corrected", "5.3.2", SUGGESTING, ABOUT, 90.0, "case-10", "E10"),
    _row("simulated, tracking", "4.3.2", SUGGESTING, MOST, 5.0, "case-7",
         "simulated_none_tracking"),
    _row("simulated d2, tracking", "4.3.2", SUGGESTING, MOST, 5.0, "case-7",
         "simulated_d2_tracking"),
    _row("exact, tracking", "4.3.2", SUGGESTING, MOST, 10.0, "case-7", "none_tracking"),
    _row("CAROCA, tracking", "4.4.2", SUGGESTING, MOST, 5.0, "case-8", "tracking"),
    _row("CAROCA, Est. 2", "2.3.4", HELD_OUT, ABOUT, 35.0, "case-1", "c_2"),
    _row("CAROCA, Est. 3", "2.3.4", HELD_OUT, ABOUT, 35.0, "case-1", "c_3"),
    _row("simulated d2, servo", "4.3.2", HELD_OUT, ABOUT, 20.0, "case-7", "simulated_d2_servo"),
    _row("ACROBOT, Est. 1 to 3", "2.3.2", HELD_OUT, MOST, 10.0, "case-1", "a_1", "a_2", "a_3"),
    _row("ACROBOT, Est. 4 to 7", "2.3.2", HELD_OUT, MOST, 15.0, "case-1",
         *(f"a_{key}" for key in LENGTHS)),
    _row("exact, servo", "4.3.2", HELD_OUT, MOST, 10.0, "case-7", "none_servo"),
    _row("simulated, servo", "4.3.2", HELD_OUT, MOST, 5.0, "case-7", "simulated_none_servo"),
    _row("CAROCA, best estimator", "2.3.4", HELD_OUT, LEAST, 15.0, "case-1",
         *(f"c_{key}" for key in ("1", "2", "3", *LENGTHS))),
    _row("CAROCA, servo", "4.4.2", HELD_OUT, LEAST, 25.0, "case-8", "servo"),
)  # fmt: skip
"""All deviations in the image that the thesis prints."""

AT_OWN_WIDTH = (
    ("case-7", "d1_tracking"),
    ("case-7", "simulated_d2_servo"),
    ("case-7", "none_servo"),
    ("case-1", "c_2"),
)
"""Configurations that are also run with a camera of each width."""

QUICK = (("case-7", "none_servo"),)
"""Those of the quick form."""


def cases(form: Form) -> Iterator[Case]:
    """Each configuration with the scenarios' camera, some with a camera of each width."""
    wanted: dict[tuple[str, str], tuple[int, ...]] = {
        (row.study, name): (OWN_WIDTH,) for row in ROWS for name in row.configurations
    }
    wanted |= dict.fromkeys(AT_OWN_WIDTH, WIDTHS)
    for (study, name), widths in wanted.items():
        if form.quick and (study, name) not in QUICK:
            continue
        planned = _planned(study)[name]
        for width in widths:
            camera = (f"camera.width={width}", f"camera.height={width * 3 // 4}")
            yield replace(
                planned,
                name=f"{study} {name} {width}",
                keys={"study": study, "configuration": name, "width": width},
                changes=(*planned.changes, *camera),
                seeds=None,
                printed={},
                why="",
            )


@cache
def _planned(study: str) -> Mapping[str, Case]:
    """Cases of a case study with projected images, by configuration."""
    run = CATALOGUE[study].run
    assert isinstance(run, Study)
    return {
        case.keys["configuration"]: case
        for case in run.plan(Form())
        if case.keys["camera"] == PROJECTED
    }


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A run of a case study.

    Returns:
        outcome; deviation_1600_px: the largest distance of the object's centre from its straight
        line, of an image 1600 px wide whatever the camera's width.
    """
    row = measure_run(case, seed)
    return {"outcome": row["outcome"], "deviation_1600_px": row["image_max_px"]}


@dataclass(frozen=True)
class Fit:
    """How one width fits a group of rows.

    Attributes:
        ratios: Ours over the printed numbers, of rows that are printed as a size.
        kept: How many bounds are kept.
        informative: How many of the kept upper bounds with at least `INFORMATIVE` of them.
        bounds: How many bounds there are.
    """

    ratios: tuple[float, ...]
    kept: int
    informative: int
    bounds: int

    @property
    def median(self) -> float:
        """Median ratio."""
        return float(np.median(self.ratios))

    @property
    def fits(self) -> bool:
        """Whether the median ratio is within `FITS` of 1."""
        return 1.0 / FITS <= self.median <= FITS

    def words(self) -> str:
        """Median, least and largest ratio, and bounds."""
        return (
            f"{self.median:.2f} ({min(self.ratios):.2f} to {max(self.ratios):.2f}), "
            f"{self.kept} of {self.bounds} bounds"
        )


def fit(runs: Runs, group: str, width: int) -> Fit:
    """How a width fits the rows of a group.

    Raises:
        MissingRuns: Runs of a row are not there.
    """
    rows = [(row.kind, row.ratio(runs, width)) for row in ROWS if row.group == group]
    upper = [ratio for kind, ratio in rows if kind == MOST]
    lower = [ratio for kind, ratio in rows if kind == LEAST]
    return Fit(
        ratios=tuple(ratio for kind, ratio in rows if kind == ABOUT),
        kept=sum(ratio <= 1.0 for ratio in upper) + sum(ratio >= 1.0 for ratio in lower),
        informative=sum(INFORMATIVE <= ratio <= 1.0 for ratio in upper),
        bounds=len(upper) + len(lower),
    )


@statement(
    "A deviation in pixels is in proportion to the width of the image.",
    "not printed",
    rule=f"medians of runs with a camera of each width, within {100 * SCALES:g} %",
    basis=OURS,
)
def scales(runs: Runs) -> Finding:
    """Whether runs with a camera of a width give what is in proportion."""
    words, held = [], []
    for study, name in AT_OWN_WIDTH:
        some = {
            width: runs.median("deviation_1600_px", study=study, configuration=name, width=width)
            for width in WIDTHS
        }
        off = [some[width] / some[OWN_WIDTH] - 1.0 for width in WIDTHS if width != OWN_WIDTH]
        words.append(f"{study} {name} " + ", ".join(f"{100.0 * one:+.1f}" for one in off) + " %")
        held += [abs(one) <= SCALES for one in off]
    others = ", ".join(str(width) for width in WIDTHS if width != OWN_WIDTH)
    return Finding(
        found=f"from {OWN_WIDTH} px to {others}: " + "; ".join(words),
        held=held,
        why="Where errors of the model bend the path it is exact. Corners have 0.1 px of noise in "
        "each width, which is less of a wider image: where noise bends it, it is not.",
    )


@statement(
    f"Printed pixels are those of an image {HALF} px wide.",
    "no width is printed",
    rule=f"Three parts: the median ratio of sizes, ours at {HALF} px to the printed, is within a "
    f"factor {FITS:g} of 1 in the rows that suggested it; in those that did not; and is nearer to "
    f"1 in the latter than at {THESIS_WIDTH} px.",
    basis=OURS,
    cause=CHOICE,
)
def half_width(runs: Runs) -> Finding:
    """Whether half of the sensor's width is what was printed in."""
    rows = {
        (group, width): fit(runs, group, width)
        for group in (SUGGESTING, HELD_OUT)
        for width in WIDTHS
    }
    words = [
        f"{group}: " + "; ".join(f"{width} px {rows[group, width].words()}" for width in WIDTHS)
        for group in (SUGGESTING, HELD_OUT)
    ]
    away = {w: abs(float(np.log(rows[HELD_OUT, w].median))) for w in (HALF, THESIS_WIDTH)}
    nearest = {
        group: min(WIDTHS, key=lambda width: abs(np.log(rows[group, width].median)))
        for group in (SUGGESTING, HELD_OUT)
    }
    return Finding(
        found=". ".join(words),
        held=[
            rows[SUGGESTING, HALF].fits,
            rows[HELD_OUT, HALF].fits,
            away[HALF] < away[THESIS_WIDTH],
        ],
        why=f"Nearest to 1: {nearest[SUGGESTING]} px of the suggesting rows, {nearest[HELD_OUT]} "
        f"px of the others, which have {len(rows[HELD_OUT, HALF].ratios)} sizes.",
    )


def table(runs: Runs) -> Table:
    """A row a printed number, ours in each width beside it."""
    made = new_table(
        "Printed pixels, and ours in images of four widths",
        ("group", "section", "row", "printed"),
        tuple(f"ours at {width} [px]" for width in WIDTHS),
    )
    there = list(_shown(runs))
    if not there:
        raise MissingRuns("no printed row")
    for row in there:
        ours = row.ours(runs)
        made.add_row(
            row.group, row.source, row.label, f"{row.kind} {row.printed:g}",
            *(f"{ours * width / THESIS_WIDTH:.1f}" for width in WIDTHS),
        )  # fmt: skip
    return made


def fits_table(runs: Runs) -> Table:
    """How each width fits each group."""
    made = new_table(
        "Ours over the printed numbers, by width",
        ("group", "width [px]"),
        ("median ratio", "least", "largest", "bounds kept", "upper ones by half or more"),
    )
    for group in (SUGGESTING, HELD_OUT):
        for width in WIDTHS:
            one = fit(runs, group, width)
            made.add_row(
                group, str(width), f"{one.median:.2f}", f"{min(one.ratios):.2f}",
                f"{max(one.ratios):.2f}", f"{one.kept} of {one.bounds}", str(one.informative),
            )  # fmt: skip
    return made


def figure(runs: Runs) -> Figure:
    """Ratios of ours to the printed numbers in each width, a line a row."""
    shown = list(_shown(runs))
    drawn, axes = new_figure(1, 1, (10.0, 7.5), "Printed pixels, and ours by width of the image")
    for number, width in enumerate(WIDTHS):
        look = nth_look(number)
        axes.plot(
            [row.ratio(runs, width) for row in shown], range(len(shown)), linestyle="",
            marker=look.marker, color=look.color, label=f"image {width} px wide",
        )  # fmt: skip
    axes.axvline(1.0, **line_style(BOUND))
    for edge in (1.0 / FITS, FITS):
        axes.axvline(edge, color=BOUND.color, linewidth=0.8, linestyle=":")
    for place, row in enumerate(shown[:-1]):
        if row.group != shown[place + 1].group:
            axes.axhline(place + 0.5, color=BOUND.color, linewidth=0.8)
    axes.set_yticks(
        range(len(shown)),
        [f"{row.group}: {row.label}, {row.kind} {row.printed:g} px" for row in shown],
        fontsize=8,
    )
    axes.invert_yaxis()
    axes.set(xlabel="ours over printed [-]", xscale="log")
    plain_numbers(axes.xaxis)
    drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=len(WIDTHS))
    return drawn


def _shown(runs: Runs) -> Iterator[PrintedPixels]:
    """Rows whose runs are all there."""
    for row in ROWS:
        try:
            row.ours(runs)
        except MissingRuns:
            continue
        yield row


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    return {
        "widths_px": list(WIDTHS), "own_width_px": OWN_WIDTH, "fits": FITS, "scales": SCALES,
        "informative": INFORMATIVE,
    }  # fmt: skip


STUDY = Study(
    name="image-width",
    title="Printed pixels, and how wide the image was in which they were counted",
    source="servoing thesis 2.3, 4.3, 4.4, 5.3.2",
    cases=cases,
    measure=measure,
    seeds=(5, 1),
    checks=(scales, half_width),
    tables=(table, fits_table),
    figures={"image_width": figure},
    parameters=parameters,
    assumptions=(
        "Runs are those of the case studies, with their assumptions; seeds are 0 to 4.",
        "Rows are in a group by where they are printed: those of tracking and of slack in chapters "
        "4 and 5, of which the remark was made, and all others. Chapter 3 prints no pixels.",
        "A number that is not reached or almost reached counts as a size; the bound of several "
        "configurations is that of the one nearest to violating it.",
        "The camera of chapters 2, 4 and 5 is the same on these platforms, table A.3; the "
        "simulation of figure 4.3 has its own, which is not described.",
    ),
)
