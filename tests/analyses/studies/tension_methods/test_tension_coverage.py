"""Coverage of a grid: exact methods solve all of it, and no verdict is wrong."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_methods.coverage import CoverageTask, cover, grid_problems
from cdpr_drake.tensions.methods import METHODS


@pytest.mark.parametrize("name", ["caroca_gazebo", "planar"])
def test_exact_methods_solve_all(name):
    rows = cover(name, (4, 4, 1) if name == "planar" else (4, 3, 2))
    assert rows[0].feasible > 0
    for row in rows:
        assert row.wrong == 0
        if METHODS[row.method].exact:
            assert row.share == 1.0
        assert 0.0 <= row.share <= 1.0
        json.dumps(row.as_dict(), allow_nan=False)


def test_grid_lies_inside_the_frame():
    assert len(grid_problems("acrobot_large", (3, 2, 2))) == 2 * 12


def test_some_methods_alone_are_the_same_rows():
    counts, some = (2, 2, 2), ("linear_program", "barycenter")
    task = CoverageTask("acrobot_large", counts, some)
    parts = [task(k, k + 1)["numbers"] for k in range(2)]
    rows = task.rows({"numbers": np.concatenate(parts)})
    whole = [row for row in cover("acrobot_large", counts) if row.method in some]
    assert sorted(map(untimed, rows)) == sorted(map(untimed, whole))
    assert all(isinstance(row.solved, int) for row in rows)


def untimed(row):
    return row.method, row.poses, row.feasible, row.solved, row.wrong, row.mean_largest_tension
