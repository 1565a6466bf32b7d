"""`cdpr study pick-and-place`: what it judges, and what it leaves; the runs are made up."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED, evaluate_checks
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.pick_and_place import (
    CHECKS,
    COLUMNS,
    CONDITIONS,
    HandlingTrial,
    study_pick_and_place,
    within,
)
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Failure, Phase


def row(distance=1e-3, angle_deg=0.5, failed_in=None, failure=Failure.NONE):
    """A run that set the box down so far off, or failed in a phase."""
    done = failed_in is None
    told = {
        "outcome": Outcome.COMPLETED if done else Outcome.FAILED,
        "failed_in": Phase.DONE if done else failed_in,
        "failure": failure,
        "distance_m": distance,
        "angle_rad": np.radians(angle_deg),
    }
    return np.array([float(told.get(name, 0.0)) for name in COLUMNS])


BLIND = row(0.3, 20.0, Phase.CARRY, Failure.TAG_NOT_SEEN)


def found(*rows):
    good = {name: {"runs": np.array([row(), row()])} for name in CONDITIONS}
    good["one camera"] = {"runs": np.array([BLIND])}
    if rows:
        good["in view"] = {"runs": np.array(rows)}
    return good


@pytest.mark.parametrize(
    ("rows", "good"),
    [
        ((), True),
        ((row(1.99e-3), row(1e-3, 0.99)), True),
        ((row(2.01e-3),), False),
        ((row(1e-3, 1.01),), False),
        ((row(failed_in=Phase.GRASP, failure=Failure.NOT_GRASPED),), False),
    ],
)
def test_boxes_have_to_lie_within_two_millimetres_and_a_degree(rows, good):
    statement = evaluate_checks(CHECKS, found(*rows))[0]
    assert statement.verdict == (CONFIRMED if good else NOT_CONFIRMED)
    assert np.all(within(found(*rows)["in view"]["runs"])) == good


def test_a_run_that_failed_says_why_in_the_statement():
    statement = evaluate_checks(CHECKS, found(row(), BLIND))[0]
    assert statement.found.startswith("1 of 2; largest 1.00 mm, 0.50 deg; carry: the tag")


def test_the_catalogue_names_its_judges():
    said = evaluate_checks(CHECKS, found())
    assert tuple(s.name for s in said) == STUDIES["pick-and-place"].judges
    assert [s.verdict for s in said] == [CONFIRMED] * 4


def test_it_runs_its_seeds_and_writes_numbers_and_a_figure(monkeypatch, tmp_path):
    def made_up(trial, seed):
        assert trial.camera == "projected"
        return BLIND if trial.condition == "one camera" else row(1e-3 * (1 + seed))

    monkeypatch.setattr(HandlingTrial, "row", made_up)
    study = study_pick_and_place(True, DEFAULT_STUDY_SESSION)
    assert not study.interrupted
    study.write(tmp_path)
    told = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert told["columns"] == list(COLUMNS)
    assert set(told["runs"]) == set(CONDITIONS)
    assert (tmp_path / "set_down.png").stat().st_size > 10_000
    assert len(study.tables()) == 2
