"""Coverage of a grid: exact methods solve all of it, and no verdict is wrong."""

import json

import pytest

from cdpr_drake.analyses.studies.tension_methods.coverage import cover, grid_problems
from cdpr_drake.tensions import METHODS


@pytest.mark.parametrize("name", ["caroca_gazebo", "planar"])
def test_exact_methods_solve_all(name):
    asked = []
    rows = cover(name, (4, 4, 1) if name == "planar" else (4, 3, 2), asked.append)
    assert [row.method for row in rows] == asked
    assert rows[0].feasible > 0
    for row in rows:
        assert row.wrong == 0
        if METHODS[row.method].exact:
            assert row.share == 1.0
        assert 0.0 <= row.share <= 1.0
        json.dumps(row.as_dict(), allow_nan=False)


def test_grid_lies_inside_the_frame():
    assert len(grid_problems("acrobot_large", (3, 2, 2))) == 2 * 12


def test_a_request_to_stop_keeps_what_is_finished():
    asked = []
    rows = cover("acrobot_large", (2, 2, 2), asked.append, lambda: len(asked) == 2)
    assert [row.method for row in rows] == asked
    assert len(rows) == 2
