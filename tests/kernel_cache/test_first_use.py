"""A program that calls the library is told once that kernels are compiled."""

import os
import subprocess
import sys

from tests.messages import messages

PROGRAM = """
import sys
import cdpr_drake as cdpr
robot = cdpr.load_robot("planar")
for _ in range(2):
    robot.wrench_matrix()
    print("called", file=sys.stderr, flush=True)
cdpr.solve_inverse_kinematics(robot)
"""

WORDS = "first use of Robot.wrench_matrix: compiling kernels, which are kept"


def run(program, folder):
    """What a program says on stderr, with the cache in a folder of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=folder,
        env=os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")},
    )  # fmt: skip
    return messages(done.stderr).splitlines(), done.stdout


def test_the_first_call_that_compiles_says_so_once_and_before(tmp_path):
    assert run(PROGRAM, tmp_path)[0] == [WORDS, "called", "called"]
    assert run(PROGRAM, tmp_path)[0] == ["called", "called"]  # all is kept
