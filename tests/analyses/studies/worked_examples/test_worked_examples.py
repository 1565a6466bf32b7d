"""The theses' examples: programs that agree, printed tensions, verdicts that can fail."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.worked_examples import study as study_module
from cdpr_drake.analyses.studies.worked_examples.motion import (
    DURATION,
    END,
    START,
    by_conditions,
    by_printed_coefficients,
)
from cdpr_drake.analyses.studies.worked_examples.statements import (
    CHECKS,
    border_tensions,
    keeps_limits,
    median_cheap,
    two_programs,
)
from cdpr_drake.analyses.studies.worked_examples.study import study_worked_examples

ROUNDING = 1e-9
"""Of polynomials in a time up to 100 s [m]."""


@pytest.fixture(scope="module")
def study():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_module, "QUICK_GRID", (2, 2, 2))
        return study_worked_examples(True)


def test_every_statement_is_judged(study):
    assert [one.name for one in study.statements] == [judge.__name__ for judge in CHECKS]
    verdicts = {one.name: one.verdict for one in study.statements}
    assert verdicts["two_programs"] == verdicts["meets_conditions"] == CONFIRMED
    assert verdicts["homing_tensions"] == verdicts["border_tensions"] == CONFIRMED
    assert verdicts["printed_coefficients"] == NOT_CONFIRMED
    assert verdicts["farthest_from_limits"] == IN_PART


def test_the_second_program_is_the_polynomial_of_the_conditions():
    motion = by_conditions()
    s = motion.times / DURATION
    blend = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None]
    np.testing.assert_allclose(motion.positions, START + blend * (END - START), atol=ROUNDING)


def test_the_printed_coefficients_lead_elsewhere():
    # 10 + 15 + 6 times the way, in the place of 10 - 15 + 6.
    end = by_printed_coefficients().positions[-1]
    np.testing.assert_allclose(end, START + 31.0 * (END - START), atol=ROUNDING)


def test_verdicts_can_fail(study):
    found = study.found
    motions = dict(found.motions, conditions=by_printed_coefficients())
    assert two_programs(replace(found, motions=motions)).verdict == NOT_CONFIRMED
    swapped = dict(found.polygons, border=found.polygons["homing"])
    assert border_tensions(replace(found, polygons=swapped)).verdict == NOT_CONFIRMED
    one = found.methods["barycenter"]
    methods = dict(found.methods, barycenter=replace(one, wrong=1))
    assert keeps_limits(replace(found, methods=methods)).verdict == NOT_CONFIRMED


@pytest.mark.parametrize(
    ("cost", "said"), [(1.0, CONFIRMED), (8.0, IN_PART), (10.0, NOT_CONFIRMED)]
)
def test_a_cost_is_compared_with_that_of_the_barycenter(study, cost, said):
    costs = {"improved_closed_form": cost, "median": 3.0, "barycenter": 10.0}
    methods = {
        name: replace(study.found.methods[name], microseconds=value)
        for name, value in costs.items()
    }
    assert median_cheap(replace(study.found, methods=methods)).verdict == said


def test_it_leaves_numbers_and_figures(study, tmp_path):
    study.write(tmp_path, ("png",))
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["polygons"]["homing"]["area_n2"] > results["polygons"]["border"]["area_n2"]
    assert {path.stem for path in tmp_path.glob("*.png")} == {"trajectory", "feasible_polygons"}
    assert len(study.tables()) == 2


def test_it_stops_where_it_is_asked_to():
    asked = []
    session = StudySession(should_stop=lambda: bool(asked) or asked.append(1))
    study = study_worked_examples(True, session)
    assert study.interrupted
    assert study.found.motions
    assert not study.found.polygons
    names = [one.name for one in study.statements]
    assert names == ["two_programs", "meets_conditions", "printed_coefficients"]
