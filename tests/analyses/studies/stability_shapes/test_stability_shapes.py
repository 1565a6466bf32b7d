"""Shapes of workspaces: what is asked for, verdicts on made-up shapes, a run that goes on."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_JUDGED,
    NOT_TESTABLE,
)
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import MET_FITTED
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.published.stability_tables import TABLES
from cdpr_drake.analyses.studies.stability_shapes import statements as said
from cdpr_drake.analyses.studies.stability_shapes.figures import (
    FIGURES,
    nested_figure,
    planar_figure,
    solids_figure,
)
from cdpr_drake.analyses.studies.stability_shapes.items import (
    BASELINE,
    PANELS,
    SETS,
    TURN,
    TURNED_FIGURE,
    shape_row,
)
from cdpr_drake.analyses.studies.stability_shapes.study import STUDY
from tests.analyses.studies.made_up_studies import check_tables_are_made
from tests.figure_faults import figure_faults

CASES = {(one.keys["figure"], one.keys["panel"]): one for one in STUDY.plan(Form(quick=True))}


def shape(figure, panel, holds):
    """The row of a workspace of the positions for which `holds(x, y, z)` is true."""
    case = CASES[figure, panel]
    grid = case.task.grid
    x, y, z = np.meshgrid(*grid.axes, indexing="ij")
    inside = np.broadcast_to(holds(x, y, z), grid.shape)
    row = shape_row(case, {"stable": inside.ravel()})
    return Run(case.name, None, case.keys, row, case.printed)


def everywhere(x, y, z):
    return np.ones_like(x, bool)


def below(height):
    return lambda x, y, z: z <= height


def made_up(**changed):
    """All workspaces full, but for those that are named `figure panel`."""
    assert set(changed) <= set(full())
    others = {key: shape(*key.split(" ", 1), holds) for key, holds in changed.items()}
    return Runs(list((full() | others).values()))


@cache
def full():
    """All workspaces without a limit."""
    return {f"{figure} {panel}": shape(figure, panel, everywhere) for figure, panel in CASES}


def test_nested_workspaces_lie_over_the_baseline_a_panel_for_each_bound():
    half = [shape("3.8", name, lambda x, y, z: x > 0.0) for name in ("r_bp=0.1", "r_s=0.5")]
    figure = nested_figure(Runs([shape("3.8", BASELINE, everywhere), *half]), "3.8")
    assert figure_faults(figure) == []
    assert [axes.get_title() for axes in figure.axes] == ["(a) r_bp", "(b) r_s"]
    for axes, one in zip(figure.axes, half, strict=True):
        whole, part = axes.lines
        assert len(whole.get_xdata()) == one["positions"]
        assert np.min(part.get_xdata()) > 0.0
        words = [text.get_text() for text in axes.get_legend().get_texts()]
        assert words[0].startswith("baseline: 100.0 (95.4) %")
        assert words[1].startswith(one["panel"])


def test_start_and_goal_are_drawn_where_they_are_printed():
    runs = Runs([shape("3.32", "d_theta_pc=55 deg alone", everywhere)])
    figure = solids_figure(runs, "3.32")
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    assert "published 50.7" in axes.get_title()
    starts = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(starts) == 1


def test_panels_are_rows_of_the_tables():
    tables = {table.name: table for table in TABLES}
    for figure, (name, rows) in PANELS.items():
        for bound, value in rows:
            label = f"{bound.removesuffix('_deg')}={value:g}" + " deg" * bound.endswith("_deg")
            printed = CASES[figure, label].printed["share_percent"]
            assert float(printed) == tables[name].rows[bound][value]
    for name in SETS:
        angles = CASES[TURNED_FIGURE, name].task.grid.angles
        assert len(angles) == 7
        assert np.max(np.linalg.norm(angles, axis=1)) == pytest.approx(TURN)


def test_a_position_counts_that_holds_in_every_orientation():
    case = CASES[TURNED_FIGURE, "D1"]
    stable = np.ones(case.task.grid.shape, bool)
    stable[3, 0, 0, 0] = False
    row = shape_row(case, {"stable": stable.ravel()})
    assert not row["inside"][0, 0, 0]
    assert row["positions"] - row["positions_inside"] == 1
    assert row["share_percent"] < 100.0


def low_corners(x, y, z):
    return z <= 0.3


def cone(x, y, z):
    return np.maximum(np.abs(x), np.abs(y)) <= 0.5 - 0.8 * z


def slab(x, y, z):
    return np.abs(x) <= 0.2


MADE_UP = [
    (said.corners_stay, {f"{f} r_bp=0.5": low_corners for f in said.ACROBOT_FIGURES}, CONFIRMED),
    (said.corners_stay, {f"{f} r_bp=0.5": cone for f in said.ACROBOT_FIGURES[:1]}, IN_PART),
    (said.corners_stay, {}, NOT_CONFIRMED),
    (said.pyramid, {"3.13 d_theta_bp=30 deg": cone, "3.20 d_theta_bp=20 deg": cone,
                    "3.25 d_theta_bp=30 deg": cone}, CONFIRMED),
    (said.pyramid, {}, NOT_CONFIRMED),
    (said.flattens_to_yz, {"3.13 r_B=0.03": slab, "3.20 r_B=0.02": slab, "3.25 r_B=0.03": slab},
     CONFIRMED),
    (said.flattens_to_yz, {"3.13 r_B=0.03": lambda x, y, z: np.abs(y) <= 0.2}, NOT_CONFIRMED),
    (said.tiny, {"3.13 r_A=0.1": lambda x, y, z: x**2 + y**2 + z**2 < 0.02}, CONFIRMED),
    (said.tiny, {}, NOT_CONFIRMED),
    (said.tiny, {"3.13 r_A=0.1": lambda x, y, z: (x > 0.4) & (y > 0.4) & (z < 0.05)}, IN_PART),
    (said.tiny, {"3.13 r_A=0.1": lambda x, y, z: z < -1.0}, NOT_CONFIRMED),
    (said.downward, {key: below(0.3) for key in (" ".join(one) for one in CASES
                     if one[0] == "3.13" and one[1] != BASELINE)}, CONFIRMED),
    (said.downward, {}, NOT_CONFIRMED),
    (said.flat, {"3.15 r_bp=0.3": below(1.5), "3.15 r_bp=1": below(0.7)}, CONFIRMED),
    (said.flat, {"3.15 r_bp=0.3": below(1.5)}, IN_PART),
    (said.flat, {"3.15 r_bp=0.3": lambda x, y, z: np.abs(x) < 0.5}, NOT_CONFIRMED),
    (said.width_by_camera, {"3.15 d_theta_pc=20 deg": lambda x, y, z: np.abs(x) < 0.6}, CONFIRMED),
    (said.width_by_camera, {"3.15 d_theta_pc=20 deg": below(1.0)}, NOT_CONFIRMED),
    (said.hybrid_falls_faster, {"3.13 d_theta_bp=10 deg": slab, "3.20 d_theta_bp=30 deg": slab,
                                "3.20 r_bp=0.5": slab, "3.13 r_A=0.1": slab}, MET_FITTED),
    (said.hybrid_falls_faster, {"3.13 d_theta_bp=10 deg": slab}, IN_PART),
    (said.hybrid_falls_faster, {}, NOT_CONFIRMED),
    (said.downward, {key: lambda x, y, z: z < -1.0 for key in (" ".join(one) for one in CASES
                     if one[0] == "3.13" and one[1] != BASELINE)}, NOT_CONFIRMED),
    (said.combinations, {}, NOT_TESTABLE),
    (said.start_inside, {}, CONFIRMED),
    (said.start_inside, {"4.2 D1": below(0.0)}, IN_PART),
    (said.goal_outside_twice, {"4.2 D2": slab, "4.2 D3": slab}, CONFIRMED),
    (said.goal_outside_twice, {}, NOT_CONFIRMED),
    (said.points_make_smaller, {"4.2 D1": below(0.7), "4.2 D2": slab, "4.2 D3": slab,
                                "4.2 D4": below(0.7)}, CONFIRMED),
    (said.points_make_smaller, {}, NOT_CONFIRMED),
]  # fmt: skip


@pytest.mark.parametrize(("check", "changed", "expected"), MADE_UP)
def test_made_up_shapes(check, changed, expected):
    assert check.judge(made_up(**changed)).verdict == expected


def test_the_quick_form_stops_goes_on_and_is_written(tmp_path):
    folder, seen, name = tmp_path / "shapes", [], "shapes_3_10"
    study = replace(STUDY, figures={name: STUDY.figures[name]})
    stop = StudySession(folder, seen.append, lambda: bool(seen) and seen[-1].done > 0, 1)
    first = study(True, stop)
    assert first.interrupted
    found = study(True, StudySession(folder, workers=1))
    assert not found.interrupted
    assert found.progress.found == first.progress.done
    shares = [found.runs.one(figure="3.10", panel=f"Cb. {n}")["share_percent"] for n in (2, 13)]
    assert shares[0] > 0.0 == shares[1]
    assert NOT_JUDGED not in {one.verdict for one in found.statements}
    found.write(folder, ("png",))
    stored = json.loads((folder / "results.json").read_text())
    assert {one["panel"] for one in stored["runs"]} >= {"Cb. 2", "Cb. 13"}
    assert {one["name"] for one in stored["statements"]} >= {"combinations"}
    assert {path.stem for path in folder.glob("*.png")} == {name} < set(FIGURES)
    check_tables_are_made(found)
    caption = str(found.tables()[0].caption)
    assert caption == "Coarse grid: not to be compared with the published numbers."
    assert len(planar_figure(found.runs, "3.10").axes) == 2
