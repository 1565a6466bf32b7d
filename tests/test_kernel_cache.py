"""Compiled kernels are kept outside the package, whatever the machine is like."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ASK = "import cdpr_drake, os; print(os.environ['NUMBA_CACHE_DIR'])"
COMPILE = (
    "import os, numpy as np, cdpr_drake; from cdpr_drake.geometry import cable_lengths, "
    "length_jacobian; from pydrake.math import RigidTransform as X; "
    "length_jacobian(X(), np.ones((3, 2)), np.zeros((3, 2))); "
    "print(sum(len(f) for _, _, f in os.walk(os.environ['NUMBA_CACHE_DIR'])))"
)


def run(words, **environment):
    kept = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-c", words], capture_output=True, text=True, env={**kept, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_they_are_in_the_users_cache_folder(tmp_path):
    folder = Path(run(ASK, XDG_CACHE_HOME=str(tmp_path)))
    assert folder.parent == tmp_path / "cdpr_drake" / "kernels"
    assert int(run(COMPILE, XDG_CACHE_HOME=str(tmp_path))) >= 2


def test_the_users_own_choice_counts(tmp_path):
    assert run(ASK, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


@pytest.mark.parametrize("environment", [{"XDG_CACHE_HOME": "/proc/nowhere"}, {"HOME": ""}])
def test_without_a_cache_folder_of_ones_own_it_still_runs(environment, tmp_path):
    assert int(run(COMPILE, TMPDIR=str(tmp_path), **environment)) >= 2


def test_old_states_of_the_sources_are_forgotten(tmp_path):
    kernels = tmp_path / "cdpr_drake" / "kernels"
    for number in range(5):
        (kernels / f"state{number}").mkdir(parents=True)
        os.utime(kernels / f"state{number}", (number, number))
    run(ASK, XDG_CACHE_HOME=str(tmp_path))
    assert sorted(os.listdir(kernels)) == ["state3", "state4"]
