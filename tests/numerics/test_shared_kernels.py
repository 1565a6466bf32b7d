"""Kernels that others call by a slot, compiled when somebody comes there."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numba import errors

from cdpr_drake.numerics import shared_kernels
from cdpr_drake.numerics.kernel_calls import any_scalar
from tests.numerics import shared_examples
from tests.numerics.shared_examples import caller, fill, refuse, stretched, wrongly

ROOT = Path(__file__).parent.parent.parent

SAY = """
import numpy as np
from tests.numerics.shared_examples import caller, fill, stretched
A = np.zeros((2, 3))
print(caller(A, False, 0.5), stretched.is_made(), fill.is_made(), A[0, 0], A[1, 1])
print(caller(A, True, 0.5), fill.is_made(), A[1, 1])
print(sum(caller.stats.cache_hits.values()))
"""


def say(folder):
    words = [sys.executable, "-c", SAY]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_one_is_compiled_when_somebody_comes_there_and_the_caller_is_kept(tmp_path):
    """What is kept on disk finds the slots of another process, where all else has moved."""
    compiled, loaded = say(tmp_path), say(tmp_path)
    assert compiled == ["(6.5, True) True False 2.0 0.0", "(6.5, True) True 3.0", "0"]
    assert loaded == [*compiled[:2], "1"]


def test_calls_from_kernels_python_and_threads_give_what_the_source_gives():
    A = np.zeros((2, 3))
    plain = any_scalar(caller)
    assert plain(A.copy(), True, 0.5) == caller(A, True, 0.5) == (6.5, True)
    assert np.all(A == 3.0)
    assert caller.py_func(np.zeros((2, 3)), True, 0.5) == (6.5, True)  # by way of Python
    with ThreadPoolExecutor(4) as pool:
        found = pool.map(lambda k: caller(np.zeros((2, 3)), True, k / 64.0)[0], range(64))
    assert list(found) == [6.0 + k / 64.0 for k in range(64)]


def test_arrays_that_one_returns_are_counted():
    a = np.zeros(3)
    _, row, _ = stretched((1.0, 2.0, 3.0), a, 2)
    held = sys.getrefcount(a)
    for _ in range(1000):
        caller(np.zeros((2, 3)), False, 0.0)
    assert sys.getrefcount(a) == held
    assert row.base is None or sys.getrefcount(row) <= 3


def test_what_one_raises_reaches_who_called_its_caller():
    with pytest.raises(ValueError, match="more than 1"):
        caller(np.zeros((2, 3)), False, 2.0)


@pytest.mark.parametrize("problem", [KeyboardInterrupt("now"), OSError("disk is full")])
def test_what_happens_while_one_is_compiled_reaches_who_called(problem, monkeypatch):
    """The slot stays empty, and the next call tries again."""

    def broken(*_):
        raise problem

    caller(np.zeros((2, 3)), False, 0.0)
    monkeypatch.setattr(shared_kernels, "kernel_address", broken)
    fill.forget()
    with pytest.raises(type(problem), match=str(problem)):
        caller(np.zeros((2, 3)), True, 0.0)
    assert not fill.is_made()
    monkeypatch.undo()
    A = np.zeros((2, 3))
    caller(A, True, 0.0)
    assert fill.is_made()
    assert A[1, 2] == 3.0


def test_arguments_of_other_types_are_refused_when_the_caller_is_compiled():
    with pytest.raises(errors.TypingError, match=r"refuse: found array\(float64, 2d, C\)"):
        wrongly(2)


def test_it_is_a_kernel_for_who_looks_at_it():
    assert refuse(0.5) == 0.5
    assert refuse.py_func(0.25) == 0.25
    assert refuse.__doc__ == shared_examples.refuse.__doc__
    assert refuse.signatures
