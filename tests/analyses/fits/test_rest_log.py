"""What calibrations by balance take of a recorder's log."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.fits.rest_log import at_rest
from cdpr_drake.analyses.fits.setup import CalibrationTask
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.models.robot_loader import load_robot

STANDS, STOPS, NOISE = 30, 5, 1e-4


@pytest.fixture(scope="module")
def stopping():
    """Lengths, swivel angles that pass pi, and tensions of stops and ways between, at 10 Hz."""
    random = np.random.default_rng(0)
    corners = random.uniform(-0.2, 0.2, (STOPS + 1, 4))
    corners[2, 0] = 0.0  # a swivel angle whose noise jumps from pi to -pi
    way = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, 40))[:, None]
    rows = np.vstack([
        part for a, b in pairwise(corners) for part in (np.tile(a, (STANDS, 1)), a + way * (b - a))
    ])  # fmt: skip
    swivels = np.pi + rows + NOISE * random.standard_normal(rows.shape)
    return Measurements(
        Path("drive.csv"), len(rows), time=0.1 * np.arange(len(rows)),
        lengths=1.0 + rows + NOISE * random.standard_normal(rows.shape),
        swivels=np.arctan2(np.sin(swivels), np.cos(swivels)),
        tensions=40.0 + 20.0 * rows + 0.1 * random.standard_normal(rows.shape),
    ), corners[:-1]  # fmt: skip


def task(log, rest=None):
    unknown = ("length_offsets",)
    return CalibrationTask(robot=load_robot("irma4u"), log=log, unknown=unknown, rest=rest)


def test_each_stop_is_a_row_with_its_means(stopping):
    log, corners = stopping
    stops = at_rest(task(log))
    means = stops.log
    assert stops.rest is None
    assert means.count == STOPS
    np.testing.assert_allclose(means.lengths, 1.0 + corners, atol=3.0 * NOISE)
    off = np.exp(1j * means.swivels) / np.exp(1j * (np.pi + corners))
    np.testing.assert_allclose(np.angle(off), 0.0, atol=3.0 * NOISE)
    np.testing.assert_allclose(means.tensions, 40.0 + 20.0 * corners, atol=0.1)
    words = means.remarks[-1]
    assert f"of {log.count} rows are at rest, in {STOPS} groups" in words
    assert "rows in which a length or an angle changes" in words


def test_a_log_that_balance_does_not_need_stays_as_it_is(stopping):
    log, _ = stopping
    for unchanged in (task(log, rest=False), task(replace(log, time=None))):
        assert at_rest(unchanged) is unchanged


def test_without_a_stop_balance_is_left_out_unless_it_is_required():
    time = 0.1 * np.arange(200)
    rows = 0.2 * np.sin(0.8 * time[:, None] + np.arange(4))
    drive = Measurements(
        Path("drive.csv"), 200, time=time, lengths=1.0 + rows, tensions=40.0 + rows
    )
    moving = at_rest(task(drive))
    assert moving.rest is False
    assert "never rests: balance of forces is not used" in moving.log.remarks[-1]
    assert at_rest(task(drive, rest=True)).log.count == 200
