"""`cdpr study pick-and-place`: what it judges, and what it leaves; the runs are made up."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED
from cdpr_drake.analyses.studies.pick_and_place import CLEAR, CONDITIONS, STUDY, outcome_of
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Failure, Phase


def row(distance=1e-3, angle_deg=0.5, failed_in=None, failure=Failure.NONE):
    """A run that set the box down so far off, or failed in a phase."""
    done = failed_in is None
    outcome = Outcome.COMPLETED if done else Outcome.FAILED
    phase = Phase.DONE if done else failed_in
    ended = outcome_of(outcome, phase, failure, distance, float(np.radians(angle_deg)))
    zero = ("offset_x_m", "offset_y_m", "offset_z_m", "time_s", "losses", "unseen_s")
    return ended | dict.fromkeys(zero, 0.0)


BLIND = row(0.3, 20.0, Phase.CARRY, Failure.TAG_NOT_SEEN)


def found(*rows, quick=False):
    """The study with these runs in view, two good ones without, and one camera that is blind."""

    def measure(case, seed):
        if case.name == "one camera":
            return BLIND
        return rows[seed % len(rows)] if rows and case.name == CLEAR else row()

    seeds = max(len(rows), 2)
    return replace(STUDY, measure=measure)(True, StudySession(workers=1, seeds=seeds))


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
    statement = found(*rows).statements[0]
    assert statement.verdict == (CONFIRMED if good else NOT_CONFIRMED)


def test_a_run_that_failed_says_why_in_the_statement():
    statement = found(row(), BLIND).statements[0]
    assert statement.verdict_words == "in part (1 of 2)"
    assert statement.found.startswith("1 of 2; largest 1.00 mm, 0.50 deg; carry: the tag")


def test_it_writes_numbers_and_a_figure(tmp_path):
    study = found()
    assert [s.verdict for s in study.statements] == [CONFIRMED] * 4
    assert study.write(tmp_path) == {}
    assert (tmp_path / "set_down.png").stat().st_size > 10_000
    assert set(study.runs.counts("condition")) == set(CONDITIONS)
    assert len(study.tables()) == 2
