"""Coverage of a grid: exact methods solve all of it, and no verdict is wrong."""

import json

import pytest

from cdpr_drake.analyses.studies.tension_methods.coverage import cover, grid_problems
from cdpr_drake.tensions.methods import METHODS


@pytest.mark.parametrize("name", ["caroca_gazebo", "planar"])
def test_exact_methods_solve_all(name):
    rows = cover(name, (4, 4, 1) if name == "planar" else (4, 3, 2))
    assert rows[0]["feasible"] > 0
    for row in rows:
        assert row["wrong"] == 0
        if METHODS[row["method"]].exact:
            assert row["share"] == 1.0
        assert 0.0 <= row["share"] <= 1.0
        json.dumps(row.measured, allow_nan=False)


def test_grid_lies_inside_the_frame():
    assert len(grid_problems("acrobot_large", (3, 2, 2))) == 2 * 12


def test_some_methods_alone_are_the_same_rows():
    counts, some = (2, 2, 2), ("linear_program", "barycenter")
    rows = [cover("acrobot_large", counts, [method])[0] for method in some]
    whole = {row["method"]: row for row in cover("acrobot_large", counts)}
    for row in rows:
        assert untimed(row) == untimed(whole[row["method"]])


def untimed(row):
    return {name: row[name] for name in row.columns() if not name.endswith("_us")}
