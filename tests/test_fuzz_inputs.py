"""A few random wrong inputs; `python -m tests.fuzz_inputs` tries thousands."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_wrong_input_is_refused_in_a_line_and_harms_nothing():
    """Twenty cases; the time limit of a case is there to end one that hangs, not to measure it."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.fuzz_inputs", "--count", "20", "--longest", "300"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "20 cases, 0 with findings" in done.stdout
