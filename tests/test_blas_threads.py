"""Results do not depend on how many threads linear algebra has, nor do users lose theirs."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  its library is loaded before threads are set
from threadpoolctl import threadpool_info, threadpool_limits

import cdpr_drake as cdpr
from cdpr_drake import blas_threads
from cdpr_drake.analyses import tensions
from cdpr_drake.analyses.frame.jobs import finished_jobs
from tests.messages import messages

NO_CALLS = ("TENSION_METHODS", "environment_names", "make_environment", "studies")
"""Public names of the front that compute nothing themselves."""

FRONT = Path(cdpr.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
MODULES = r"analyses\.(?:front\.\w+|statics\.static|tensions|view|kinematics|equilibria)"
VERBS = [name for name in re.findall(MODULES + r" import (\w+)", FRONT) if name not in NO_CALLS]


def product(seed: int) -> bytes:
    """A product of matrices that has other digits with two threads than with one."""
    A = np.random.default_rng(seed).standard_normal((300, 100))
    return (A.T @ A).tobytes()


def threads() -> set[int]:
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.fixture
def two_threads():
    """What a user set, and the product with one thread."""
    with threadpool_limits(1, user_api="blas"):
        alone = product(0)
    with threadpool_limits(2, user_api="blas"):
        assert product(0) != alone
        yield alone


def test_a_call_has_the_numbers_of_one_thread_and_the_users_threads_stay(two_threads, monkeypatch):
    found, as_robot = [], tensions.as_robot
    monkeypatch.setattr(
        tensions, "as_robot", lambda *given: (found.append(product(0)), as_robot(*given))[1]
    )
    cdpr.solve_tensions("acrobot_small")
    assert found == [two_threads]
    assert threads() == {2}


def test_the_users_threads_stay_after_a_call_that_is_refused(two_threads):
    with pytest.raises(cdpr.CdprError):
        cdpr.solve_tensions("no_such_robot")
    assert threads() == {2}


class Held(Exception):
    """Somebody asked for one thread."""


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_asks_for_one_thread_before_anything_else(verb, monkeypatch):
    def held():
        raise Held

    monkeypatch.setattr(blas_threads, "_libraries", held)
    with pytest.raises(Held):
        getattr(cdpr, verb)()


def test_workers_have_one_thread_from_the_start(two_threads, monkeypatch):
    for name in blas_threads.ONE_THREAD:
        monkeypatch.setenv(name, "2")
    assert [job.result for job in finished_jobs(product, [0, 0], 2)] == 2 * [two_threads]
    assert os.environ["OPENBLAS_NUM_THREADS"] == "2"


def test_a_command_has_one_thread_from_the_start():
    program = (
        "import sys\n"
        "from cdpr_drake.cli import main\n"
        "sys.argv = ['cdpr', 'robots', '--json']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import numpy, threadpoolctl\n"
        "print([one['num_threads'] for one in threadpoolctl.threadpool_info()"
        " if one['user_api'] == 'blas'], file=sys.stderr)\n"
    )
    environment = {**os.environ, **dict.fromkeys(blas_threads.ONE_THREAD, "2")}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment
    )
    assert set(re.findall(r"\d+", messages(done.stderr).splitlines()[-1])) == {"1"}
