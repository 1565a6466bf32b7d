"""The theses' examples: programs that agree, printed tensions, verdicts that can fail."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_JUDGED
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.worked_examples import examples
from cdpr_drake.analyses.studies.worked_examples.examples import (
    DURATION,
    END,
    METHODS,
    START,
    TRAJECTORY,
    by_conditions,
    by_printed_coefficients,
)
from cdpr_drake.analyses.studies.worked_examples.study import STUDY
from tests.analyses.studies.made_up_studies import check_tables_are_made

ROUNDING = 1e-9
"""Of polynomials in a time up to 100 s [m]."""

ONE = StudySession(workers=1)


@pytest.fixture(scope="module")
def study():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(examples, "QUICK_GRID", (2, 2, 2))
        return STUDY(True, ONE)


def verdicts(runs):
    return {check.name: check.judge(runs).verdict for check in STUDY.checks}


def changed(study, example, **columns):
    """The runs with other numbers of an example."""
    rows = [
        replace(run, measured={**run.measured, **columns}) if run.case == example else run
        for run in study.runs
    ]
    return Runs(rows, study.runs.planned)


def test_every_statement_is_judged(study):
    found = {one.name: one.verdict for one in study.statements}
    assert tuple(found) == STUDY.names_of_checks()
    assert NOT_JUDGED not in found.values()
    assert found["two_programs"] == CONFIRMED
    assert found["meets_conditions"] == MET_CONSTRUCTION
    assert found["homing_tensions"] == found["border_tensions"] == CONFIRMED
    assert found["printed_coefficients"] == NOT_CONFIRMED
    assert found["farthest_from_limits"] == IN_PART


def test_the_second_program_is_the_polynomial_of_the_conditions():
    positions, _, _ = by_conditions()
    s = np.linspace(0.0, 1.0, len(positions))
    blend = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None]
    np.testing.assert_allclose(positions, START + blend * (END - START), atol=ROUNDING)
    assert DURATION == 100.0


def test_the_printed_coefficients_lead_elsewhere():
    # 10 + 15 + 6 times the way, in the place of 10 - 15 + 6.
    end = by_printed_coefficients()[0][-1]
    np.testing.assert_allclose(end, START + 31.0 * (END - START), atol=ROUNDING)


def test_verdicts_can_fail(study):
    printed = by_printed_coefficients()[0]
    said = verdicts(changed(study, TRAJECTORY, class_positions_m=printed))
    assert said["two_programs"] == said["meets_conditions"] == NOT_CONFIRMED
    swapped = verdicts(changed(study, "border", **study.runs.one(example="homing").measured))
    for name in ("border_tensions", "two_cables_more", "polygon_shrinks"):
        assert swapped[name] == NOT_CONFIRMED
    said = verdicts(changed(study, METHODS, wrong={"barycenter": 1}, pushing={"pseudo_inverse": 0}))
    assert said["keeps_limits"] == said["pushes"] == NOT_CONFIRMED


@pytest.mark.parametrize(
    ("cost", "other", "said"),
    [
        (1.0, 10.0, CONFIRMED),
        (4.5, 5.0, IN_PART),  # cheap, but hardly cheaper than the other that is named
        (80.0, 400.0, IN_PART),
        (120.0, 400.0, NOT_CONFIRMED),
    ],
)
def test_a_cost_is_compared_with_a_controller_s_period_and_the_other_method(
    study, cost, other, said
):
    costs = {"improved_closed_form": cost, "median": 3.0, "barycenter": other}
    assert verdicts(changed(study, METHODS, cost_us=costs))["median_cheap"] == said


def test_it_leaves_numbers_and_figures(study, tmp_path):
    study.write(tmp_path, ("png",))
    results = json.loads((tmp_path / "results.json").read_text())
    areas = {row["example"]: row.get("area_n2") for row in results["runs"]}
    assert areas["homing"] > areas["border"]
    assert {path.stem for path in tmp_path.glob("*.png")} == {"trajectory", "feasible_polygons"}
    assert len(study.tables()) == 2
    check_tables_are_made(study)


def test_it_stops_where_it_is_asked_to():
    asked = iter([False] + [True] * 100)
    stopped = STUDY(True, replace(ONE, should_stop=lambda: next(asked)))
    assert stopped.interrupted
    assert [run.case for run in stopped.runs] == [TRAJECTORY]
    names = [one.name for one in stopped.statements]
    assert names == ["two_programs", "meets_conditions", "printed_coefficients"]


def test_what_is_timed_is_done_alone():
    assert [case.name for case in STUDY.plan(Form()) if case.alone] == [METHODS]
