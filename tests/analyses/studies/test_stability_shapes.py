"""Shapes of workspaces: numbers of made-up ones, and what facts say of them."""

from functools import cache

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.facts import facts_of, judged
from cdpr_drake.analyses.studies.stability_shapes import (
    PANELS,
    SETS,
    STUDY,
    TURN,
    cases,
    shape_row,
)
from cdpr_drake.analyses.studies.stability_tables import BY_NAME
from cdpr_drake.analyses.studies.study import Form
from tests.figure_faults import figure_faults

CASES = {(case.keys["figure"], case.keys["panel"]): case for case in cases(Form(quick=True))}
ACROBOT = ("3.13", "3.20", "3.25")


def everywhere(x, y, z):
    return np.ones_like(x, bool)


def row_of(figure, panel, holds=everywhere):
    """The row of a workspace of the positions for which `holds(x, y, z)` is true."""
    case = CASES[figure, panel]
    task, places = case.call.args
    x, y, z = np.meshgrid(*task.grid.axes, indexing="ij")
    row = shape_row(np.broadcast_to(holds(x, y, z), x.shape), task.grid.axes, places)
    arrays = {name: row.pop(name) for name in ("inside", "x_m", "y_m", "z_m")}
    return {**case.keys, **row, "arrays": arrays}


@cache
def full():
    return {key: row_of(*key) for key in CASES}


def rows_of(**changed):
    """All workspaces full, but for those that are named `figure panel`."""
    others = {key: row_of(*key, holds) for key in CASES if (holds := changed.get(" ".join(key)))}
    assert len(others) == len(changed)
    return pd.DataFrame(list((full() | others).values()))


def below(height):
    return lambda x, y, z: z <= height


def nowhere(x, y, z):
    return z < -1.0


def cone(x, y, z):
    return np.maximum(np.abs(x), np.abs(y)) <= 0.5 - 0.8 * z


def slab(x, y, z):
    return np.abs(x) <= 0.2


def other_slab(x, y, z):
    return np.abs(y) <= 0.2


def ball(x, y, z):
    return x**2 + y**2 + z**2 < 0.02


LARGER = [panel for figure, panel in CASES if figure == "3.13" and panel != "baseline"]
FLATTER = {"3.13 r_B=0.03": slab, "3.20 r_B=0.02": slab, "3.25 r_B=0.03": slab}
TILTED = ("3.13 d_theta_bp=30 deg", "3.20 d_theta_bp=20 deg", "3.25 d_theta_bp=30 deg")

MADE_UP = [
    ("corners_stay", {f"{f} r_bp=0.5": below(0.3) for f in ACROBOT}, "confirmed"),
    ("corners_stay", {f"{f} r_bp=0.5": cone for f in ACROBOT[:1]}, "in part"),
    ("corners_stay", {f"{f} r_bp=0.5": ball for f in ACROBOT}, "in part"),  # lower, no corners
    ("pyramid", dict.fromkeys(TILTED, cone), "confirmed"),
    ("pyramid", {}, "not confirmed"),
    ("flattens_to_yz", FLATTER, "confirmed"),
    ("flattens_to_yz", {"3.13 r_B=0.03": other_slab}, "not confirmed"),
    ("tiny", {"3.13 r_A=0.1": ball}, "confirmed"),
    ("tiny", {}, "not confirmed"),
    ("tiny", {"3.13 r_A=0.1": lambda x, y, z: (x > 0.4) & (y > 0.4) & (z < 0.05)}, "in part"),
    ("tiny", {"3.13 r_A=0.1": nowhere}, "not confirmed"),
    ("downward", {f"3.13 {panel}": below(0.3) for panel in LARGER}, "confirmed"),
    ("downward", {}, "not confirmed"),
    ("downward", {f"3.13 {panel}": nowhere for panel in LARGER}, "not confirmed"),
    ("flat", {"3.15 r_bp=0.3": below(1.5), "3.15 r_bp=1": below(0.7)}, "confirmed"),
    ("flat", {"3.15 r_bp=0.3": below(1.5)}, "in part"),
    ("flat", {"3.15 r_bp=0.3": lambda x, y, z: np.abs(x) < 0.5}, "not confirmed"),
    ("width_by_camera", {"3.15 d_theta_pc=20 deg": lambda x, y, z: np.abs(x) < 0.6}, "confirmed"),
    ("width_by_camera", {"3.15 d_theta_pc=20 deg": below(1.0)}, "not confirmed"),
    ("hybrid_falls_faster", {"3.13 d_theta_bp=10 deg": slab, "3.20 d_theta_bp=30 deg": slab,
                             "3.20 r_bp=0.5": slab, "3.13 r_A=0.1": slab}, "met (fitted)"),
    ("hybrid_falls_faster", {"3.13 d_theta_bp=10 deg": slab}, "in part"),
    ("hybrid_falls_faster", {}, "not confirmed"),
    ("start_inside", {}, "confirmed"),
    ("start_inside", {"4.2 D1": below(0.0)}, "in part"),
    ("goal_outside_twice", {"4.2 D2": slab, "4.2 D3": slab}, "confirmed"),
    ("goal_outside_twice", {"4.2 D2": slab}, "in part"),
    ("goal_outside_twice", {}, "not confirmed"),
    ("points_make_smaller", {"4.2 D1": below(0.7), "4.2 D2": slab, "4.2 D3": slab,
                             "4.2 D4": below(0.7)}, "confirmed"),
    ("points_make_smaller", {}, "not confirmed"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "changed", "verdict"), MADE_UP)
def test_facts_on_made_up_shapes(name, changed, verdict):
    found = judged(facts_of("stability-shapes"), rows_of(**changed), STUDY.finds, {}, "")
    assert {one["name"]: one["verdict"] for one in found}[name] == verdict


def test_panels_are_rows_of_the_tables():
    for figure, (name, rows) in PANELS.items():
        for bound, value in rows:
            panel = f"{bound.removesuffix('_deg')}={value:g}" + " deg" * bound.endswith("_deg")
            printed = CASES[figure, panel].keys["printed_percent"]
            assert printed == BY_NAME[name].rows[bound][value]
    for name in SETS:
        angles = CASES["4.2", name].call.args[0].grid.angles
        assert np.max(np.linalg.norm(angles, axis=1)) == pytest.approx(TURN)


def test_a_position_counts_that_holds_in_every_orientation():
    call = CASES["4.2", "D1"].call
    row = call()
    assert row["orientations_rad"][0] == [0.0, 0.0, 0.0]
    assert 0 < row["positions_inside"] < row["positions"]
    alone = CASES["4.2", "baseline"].call()
    assert row["share_percent"] < alone["share_percent"]


@pytest.mark.parametrize("name", ["shapes_3_8", "shapes_3_32"])
def test_figures_show_their_panels(name):
    half = {"3.8 r_bp=0.1": lambda x, y, z: x > 0.0}
    figure = STUDY.figures[name](rows_of(**half))
    assert figure_faults(figure) == []
    words = figure.axes[0].get_title()
    assert words == "(a) r_bp" if name == "shapes_3_8" else "published 50.7" in words
    if name == "shapes_3_8":
        texts = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
        assert texts[0] == "baseline: 100.0 (95.4) %"
        assert np.min(figure.axes[0].lines[2].get_xdata()) > 0.0
