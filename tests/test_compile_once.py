"""Kernels are compiled by one process of a test session, whichever needs them first."""

import os

from numba.core.dispatcher import Dispatcher

from cdpr_drake.analyses.sweeps.worker_pool import default_workers


def test_numba_asks_first():
    assert Dispatcher.compile.__name__ == "compile_once"


def test_nobody_starts_processes_unasked():
    assert default_workers() == 1
    assert os.environ["CDPR_COMPILE_HELPERS"] == "0"
