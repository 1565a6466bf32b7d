"""The study of printed pixels: its rows, its judges on deviations that are made up."""

from dataclasses import replace

import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.image_width import (
    ABOUT,
    HELD_OUT,
    LEAST,
    MOST,
    OWN_WIDTH,
    ROWS,
    STUDY,
    SUGGESTING,
    WIDTHS,
    fit,
)
from cdpr_drake.systems.diagrams.load import load_scenario

SHARE = {ABOUT: 1.0, MOST: 0.8, LEAST: 1.2}
"""Of a printed number, what a run has that agrees with it."""


def made_up(width, held_out=None, noisy=False):
    """Runs whose deviations agree with the printed ones in an image of a width; held-out rows in
    one of another; `noisy`: a camera of another width sees something else."""

    def measure(case, seed):
        study, name = case.keys["study"], case.keys["configuration"]
        row = next(one for one in ROWS if one.study == study and name in one.configurations)
        seen = held_out if held_out and row.group == HELD_OUT else width
        px = SHARE[row.kind] * row.printed * 1600 / seen
        other = 1.2 if noisy and case.keys["width"] != OWN_WIDTH else 1.0
        return {"outcome": "converged", "deviation_1600_px": px * other}

    return measure


def study(measure, quick=False):
    return replace(STUDY, measure=measure)(quick, StudySession(workers=1, seeds=2))


def said(measure):
    return {one.name: one for one in study(measure).statements}


def test_every_row_is_a_configuration_of_its_case_study():
    cases = STUDY.plan(Form())
    there = {(case.keys["study"], case.keys["configuration"]) for case in cases}
    assert there == {(row.study, name) for row in ROWS for name in row.configurations}
    for case in cases:
        camera = load_scenario(case.data.scenario, case.changes).camera
        assert (camera.width, camera.kind) == (case.keys["width"], "projected")
        assert camera.pixel_noise == pytest.approx(0.1)
    assert {row.group for row in ROWS if row.kind == ABOUT} == {SUGGESTING, HELD_OUT}


def test_the_width_is_found_where_rows_have_one():
    found = said(made_up(800))
    assert {one.verdict for one in found.values()} == {"confirmed"}
    runs = study(made_up(800)).runs
    for group in (SUGGESTING, HELD_OUT):
        assert fit(runs, group, 800).ratios == pytest.approx(
            [1.0] * len(fit(runs, group, 800).ratios)
        )
        assert fit(runs, group, 800).kept == fit(runs, group, 800).bounds
        assert fit(runs, group, 1600).median == pytest.approx(2.0)
        assert not fit(runs, group, 1600).fits


def test_held_out_rows_can_refute_it():
    found = said(made_up(800, held_out=1600))["half_width"]
    assert (found.verdict, found.held, found.of) == ("in part", 1, 3)
    assert said(made_up(1600))["half_width"].verdict == "not confirmed"


def test_a_camera_that_does_not_scale_is_said():
    assert said(made_up(800))["scales"].held == 3 * 4
    assert said(made_up(800, noisy=True))["scales"].verdict == "not confirmed"


def test_it_draws_and_tells_in_both_forms(tmp_path):
    full = study(made_up(800))
    assert [len(table.rows) for table in full.tables()[:2]] == [len(ROWS), 2 * len(WIDTHS)]
    assert full.write(tmp_path) == {}
    assert (tmp_path / "image_width.png").exists()
    quick = study(made_up(800), quick=True)
    assert {one.verdict for one in quick.statements} == {"not judged in the quick form"}
