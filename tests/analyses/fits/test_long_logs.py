"""When poses of a log are worth a fit of all rows anew."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits import starts
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.calibration.parameters import parameter_layout
from cdpr_drake.calibration.pose_search import FoundPoses
from cdpr_drake.calibration.stations import Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.robot_loader import load_robot

MODEL = calibration_model(load_robot("planar"))
COST = 10.0
"""Of a row."""


@pytest.mark.parametrize(
    ("rows", "share", "refits"),
    [
        (starts.LONG, 0.1, 1),
        (starts.LONG + 1, 0.9, 0),
        (starts.LONG + 1, 1.1, 1),
    ],
)
def test_a_long_log_is_fitted_anew_for_a_gain_that_counts(monkeypatch, rows, share, refits):
    cost, stations = COST * rows, Stations.at([RigidTransform()] * rows)
    gain = share * starts.WORTH_A_REFIT * cost
    row = np.array([0])
    ends = FoundPoses(stations.only(row), np.array([COST - gain]))
    done = []

    def solved(*_arguments, straight):
        done.append(straight)
        raise CalibrationError("the first is counted, and no other follows")

    monkeypatch.setattr(starts, "_elsewhere", lambda *_, every: (row, ends, np.full(rows, COST)))
    monkeypatch.setattr(starts, "_solved", solved)
    fit = SimpleNamespace(model=MODEL, stations=stations)
    minimum = starts.Minimum(SimpleNamespace(layout=parameter_layout(MODEL)), fit, cost)
    assert starts._improved(None, minimum, []) is minimum
    assert len(done) == refits
