"""Kernels are compiled by one process of a test session, whichever needs them first."""

import fcntl
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from numba.core.dispatcher import Dispatcher

from cdpr_drake.analyses.sweeps import default_workers

HOOK = Path(__file__).parent / "compile_once" / "sitecustomize.py"


def test_numba_asks_first():
    assert Dispatcher.compile.__name__ == "compile_once"


def test_one_is_alone_until_it_has_compiled(tmp_path, monkeypatch):
    found = list(sys.meta_path)
    alone = runpy.run_path(str(HOOK))["_alone"]
    assert sys.meta_path == found  # numba is there already
    monkeypatch.setenv("CDPR_DRAKE_TEST_LOCKS", str(tmp_path))
    implementation = SimpleNamespace(filename_base="kernel")
    one = SimpleNamespace(_cache=SimpleNamespace(cache_path="a", _impl=implementation))

    def somebody_else_could():
        (file,) = tmp_path.iterdir()
        with file.open() as opened:
            try:
                fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

    def compile_in_vain():
        with alone(one):
            assert not somebody_else_could()
            raise KeyError

    with alone(one):
        with alone(one):  # a kernel that calls itself
            assert not somebody_else_could()
        assert not somebody_else_could()
    assert somebody_else_could()
    with pytest.raises(KeyError):
        compile_in_vain()
    assert somebody_else_could()
    with alone(SimpleNamespace(_cache=SimpleNamespace())):  # not cached
        assert len(list(tmp_path.iterdir())) == 1


def test_nobody_starts_processes_unasked():
    assert default_workers() == 1
