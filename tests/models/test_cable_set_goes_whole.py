"""Cables go from a robot to whoever needs them as a `CableSet`, so that pulleys cannot get lost."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BARE_POINTS = re.compile(r"\.(exit_points|anchor_points)\(\)")


@pytest.mark.parametrize("top", ["cdpr_drake", "systems", "analyses", "notebooks", "README.md"])
def test_bare_points_do_not_leave_the_models(top):
    # rglob does not follow the links cdpr_drake/{models,systems,analyses}.
    files = [path for path in (ROOT / top).rglob("*") if path.suffix in (".py", ".ipynb")]
    for path in files or [ROOT / top]:
        found = BARE_POINTS.search(path.read_text())
        assert found is None, f"{path}: {found}"
