"""Studies of planned motions, of proven paths and of picking and placing."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies import pick_and_place as picking
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Failure, Phase
from tests.analyses.studies.made_up_studies import made


def box(distance=1e-3, angle_deg=0.5, failed_in=None, failure=Failure.NONE):
    """A run that set the box down so far off, or failed in a phase."""
    done = failed_in is None
    outcome = Outcome.COMPLETED if done else Outcome.FAILED
    phase = Phase.DONE if done else failed_in
    ended = picking.outcome_of(outcome, phase, failure, distance, float(np.radians(angle_deg)))
    zero = ("offset_x_m", "offset_y_m", "offset_z_m", "time_s", "losses", "unseen_s")
    return ended | dict.fromkeys(zero, 0.0)


BLIND = box(0.3, 20.0, Phase.CARRY, Failure.TAG_NOT_SEEN)


def picked(*rows):
    """The study with these runs in view, two good ones without, and one camera that is blind."""

    def measure(case, seed):
        if case.name == "one camera":
            return BLIND
        return rows[seed % len(rows)] if rows and case.name == picking.CLEAR else box()

    return made(picking.STUDY, measure, seeds=max(len(rows), 2))


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        ((box(1.99e-3), box(1e-3, 0.99)), "confirmed"),
        ((box(2.01e-3),), "not confirmed"),
        ((box(1e-3, 1.01),), "not confirmed"),
        ((box(failed_in=Phase.GRASP, failure=Failure.NOT_GRASPED),), "not confirmed"),
        ((box(), BLIND), "in part (1 of 2)"),
    ],
)
def test_boxes_have_to_lie_within_two_millimetres_and_a_degree(rows, verdict):
    statement = picked(*rows).statements[0]
    assert statement.verdict_words == verdict
    if BLIND in rows:
        assert statement.found.startswith("1 of 2; largest 1.00 mm, 0.50 deg; carry: the tag")


def test_numbers_and_a_figure_of_boxes_are_written(tmp_path):
    found = picked()
    assert [one.verdict for one in found.statements] == ["confirmed"] * 4
    assert found.write(tmp_path) == {}
    assert (tmp_path / "set_down.png").stat().st_size > 10_000
    assert set(found.runs.counts("condition")) == set(picking.CONDITIONS)
    assert len(found.tables()) == 2
