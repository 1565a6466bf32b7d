"""The study of calibrations: a short form of what it repeats, and what it says of it."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.calibration import rest_poses
from cdpr_drake.analyses.catalogue import STUDIES
from cdpr_drake.analyses.reporting import StudySession
from cdpr_drake.analyses.studies.calibration import study as module
from cdpr_drake.analyses.studies.calibration import study_calibration, trials
from cdpr_drake.models import load_robot

STRAIGHT = {"true": 2.8e-4, "believed before": 5e-3, "calibrated": 2.9e-4}


@pytest.fixture(scope="module")
def study():
    """One seed with poses at random; the servo is what `cdpr study` found."""
    with pytest.MonkeyPatch.context() as patch:
        poses, _ = rest_poses(load_robot(trials.ROBOT), 25, np.random.default_rng(0))
        patch.setattr(trials, "POSES", 25)
        patch.setattr(trials, "START_POSES", 25)
        patch.setattr(trials, "designed_poses", lambda: tuple(poses))
        patch.setattr(module, "straightness", lambda trial, stop: STRAIGHT)
        return study_calibration(True, StudySession(seeds=1))


def test_points_come_back_and_are_as_sure_as_they_say(study):
    exits, anchors, squares, degrees, residuals, free = study.camera[0]
    assert exits < 2e-3  # it was 10 mm
    assert anchors < 1.5e-3  # it was 5 mm
    assert 0.5 < squares / degrees < 1.6
    assert 0.8 < residuals / free < 1.2
    assert np.sqrt(np.mean(study.tracker[0] ** 2)) < 2.0


def test_the_start_is_found_by_winches_and_tensions(study):
    distance, angle = study.start[0]
    assert distance < module.START_WITHIN
    assert angle < module.TURN_WITHIN


def test_it_says_and_writes_what_it_found(study, tmp_path):
    assert [s.verdict for s in study.statements()][-2:] == ["confirmed", "confirmed"]
    assert len(study.tables()) == 2
    study.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["parameters"]["START_OFF"] == 0.3
    assert len(written["statements"]) == 5
    assert (tmp_path / "calibration.png").is_file()


def test_it_stops_when_asked_to():
    stopped = study_calibration(True, StudySession(should_stop=lambda: True))
    assert stopped.interrupted
    assert stopped.statements() == []
    assert STUDIES["calibration"].repeats
