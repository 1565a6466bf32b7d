"""Questions that need no robot import none of what robots need."""

import subprocess
import sys

import pytest

WORDS = """
import sys
from cdpr_drake.cli import main
try:
    main({arguments!r})
except SystemExit:
    pass
heavy = ("pydrake", "numba", "matplotlib", "cv2", "scipy", "distributed", "numpy")
print("imported:", [name for name in heavy if name in sys.modules], len(sys.modules))
"""

MOST_MODULES = 700
"""Modules of Python, typer and rich; with Drake and numba there are above two thousand."""


def imported(*arguments):
    words = WORDS.format(arguments=list(arguments))
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    names, _, count = done.stdout.rpartition("imported: ")[2].rpartition(" ")
    return names, int(count)


@pytest.mark.parametrize("arguments", [(), ("--help",), ("--version",)])
def test_help_imports_nothing_heavy(arguments):
    names, count = imported(*arguments)
    assert names == "[]"
    assert count < MOST_MODULES


def test_a_question_about_tensions_draws_nothing():
    names, _ = imported("tension", "acrobot_small", "--pose", "0,0,0.3")
    assert "matplotlib" not in names
