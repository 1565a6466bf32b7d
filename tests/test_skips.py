"""The list of reasons for which tests may be skipped, and what .ci/run does with it."""

import subprocess
from pathlib import Path

import pytest

from tests.messages import messages

CHECK = Path(__file__).parent.parent / ".ci" / "check_skips"
ALLOWED = "SKIPPED [1] tests/docs/test_docstrings.py:9: the extra docs is not installed\n"
OTHER = "SKIPPED [2] tests/models/test_x.py:3: without SDFormat's own checker\n"


@pytest.mark.parametrize(("log", "code"), [("", 0), (ALLOWED, 0), (OTHER, 1), (ALLOWED + OTHER, 1)])
def test_skips_are_printed_and_one_that_is_not_listed_fails(tmp_path, log, code):
    path = tmp_path / "pytest.log"
    path.write_text(f"....s\n{log}3 passed\n", encoding="utf-8")
    done = subprocess.run([CHECK, path], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert all(line in done.stdout for line in log.splitlines())
    assert ("without SDFormat's own checker" in messages(done.stderr)) == (code == 1)
