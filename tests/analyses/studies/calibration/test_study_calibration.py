"""The study of calibrations: a short form of what it repeats, and what it says of it."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.calibration import study as module
from cdpr_drake.analyses.studies.calibration import tasks, trials
from cdpr_drake.analyses.studies.calibration.study import study_calibration
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot

STRAIGHT = {"true": 2.8e-4, "believed before": 5e-3, "calibrated": 2.9e-4}


@pytest.fixture(scope="module")
def study():
    """One seed with poses at random; the servo is what `cdpr study` found."""
    with pytest.MonkeyPatch.context() as patch:
        poses, _ = rest_poses(load_robot(trials.ROBOT), 25, np.random.default_rng(0))
        patch.setattr(trials, "POSES", 25)
        patch.setattr(trials, "START_POSES", 25)
        patch.setattr(trials, "designed_poses", lambda: tuple(poses))
        patch.setattr(tasks, "straightness", lambda trial: STRAIGHT)
        return study_calibration(True, StudySession(seeds=1, workers=1))


def test_points_come_back_and_are_as_sure_as_they_say(study):
    exits, anchors, squares, straight, degrees, residuals, free = study.camera[0]
    assert exits < 2e-3  # it was 10 mm
    assert anchors < 1.5e-3  # it was 5 mm
    assert 0.5 < squares / degrees < 1.6
    assert squares != straight
    assert 0.8 < residuals / free < 1.2
    assert np.sqrt(np.mean(study.tracker[0] ** 2)) < 2.0


def test_the_start_is_found_by_winches_and_tensions(study):
    distance, angle, place, turn = study.start[0]
    assert distance < 4.0 * place < 0.04
    assert angle < 4.0 * turn < 8.0
    assert distance < module.START_WITHIN
    assert angle < module.TURN_WITHIN


def test_it_says_and_writes_what_it_found(study, tmp_path):
    assert "half as large" in study.statements()[2].printed
    assert [s.verdict for s in study.statements()][-3:] == ["confirmed"] * 3
    assert len(study.tables()) == 2
    study.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["parameters"]["START_OFF"] == 0.3
    assert len(written["statements"]) == 7
    assert (tmp_path / "calibration.png").is_file()


def test_it_stops_when_asked_to():
    stopped = study_calibration(True, StudySession(should_stop=lambda: True, workers=1))
    assert stopped.interrupted
    assert stopped.statements() == []
    assert STUDIES["calibration"].repeats
    assert STUDIES["calibration"].continues


def test_it_goes_on_where_it_was_ended_to_the_same_bytes(monkeypatch, tmp_path):
    """Whatever ends it: every trial is in its own file as soon as it is finished."""
    done = []

    def number(kind):
        def of_seed(seed):
            done.append((kind, seed))
            return np.random.default_rng(seed).random(len(kind))

        return of_seed

    monkeypatch.setattr(tasks, "KINDS", {kind: number(kind) for kind in tasks.KINDS})
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    study_calibration(session=StudySession(whole, seeds=3, workers=1))
    everything, done[:] = list(done), []

    def die(progress):
        if progress.done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study_calibration(session=StudySession(cut, die, seeds=3, workers=1))
    assert done == everything[:4]
    told = []
    again = study_calibration(session=StudySession(cut, told.append, seeds=3, workers=1))
    assert done == everything
    assert told[0].found == 4
    assert not again.interrupted
    assert (cut / "parts.npz").read_bytes() == (whole / "parts.npz").read_bytes()
    with pytest.raises(OutputFolderError, match="seeds is 3 there, 4 here"):
        study_calibration(session=StudySession(cut, seeds=4, workers=1))
