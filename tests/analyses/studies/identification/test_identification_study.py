"""The study of identification: a short form of what it repeats, and what it says of it."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.identification import trials
from cdpr_drake.analyses.studies.identification.study import study_identification

TRACKING = np.array([[0.02, 0.1], [8e-5, 1e-3], [7.5e-5, 1e-3]])


@pytest.fixture(scope="module")
def study():
    """Two seeds with six poses; campaigns have a test of their own."""

    def campaign(scenario, seed):
        misfit = np.array([[[0.12, 0.01, 1e-5, 1e-3], [5.0, 0.2, 1e-4, 5e-3]]] * 2)
        return {"tracking": TRACKING, "misfit": misfit, "platform": np.zeros(10)}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trials, "POSES", 6)
        patch.setattr(trials, "campaign_trial", campaign)
        return study_identification(True, StudySession(workers=1))


def test_errors_are_as_the_covariance_and_the_bound_say(study):
    arrays = study.found["noise"]
    assert 2.0 < np.mean(arrays["squares"]) < 24.0  # chi-square of ten, twice
    assert np.sqrt(np.mean((arrays["errors"] / arrays["bound"]) ** 2)) < 2.0
    # What is reported of one log is what the truth gives, but for the noise of its noise levels.
    np.testing.assert_allclose(arrays["std"], arrays["bound"], rtol=0.25)
    assert np.median(arrays["random"] / arrays["bound"]) > 1.2


def test_it_judges_tables_and_writes(study, tmp_path):
    assert [s.verdict for s in study.statements()][-2:] == ["confirmed", "confirmed"]
    assert len(study.tables()) == 2
    study.write(tmp_path)
    said = json.loads((tmp_path / "results.json").read_text())
    assert said["seeds"] == [0, 1]
    assert (tmp_path / "identification.png").exists()


def test_the_command_line_knows_it():
    assert STUDIES["identification"].continues
    assert STUDIES["identification"].repeats
