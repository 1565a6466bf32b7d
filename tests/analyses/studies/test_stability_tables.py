"""All rows of the servoing thesis' tables A.8 to A.18, as printed."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.stability_tables import (
    BASELINE_VALUES,
    BY_NAME,
    TABLES,
    covering_pairs,
    nested_pairs,
    steps_of,
)
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.models.robot_loader import load_robot

COUNTS = {
    "A.8": 44, "A.9": 40, "A.10": 42, "A.11": 39, "A.12": 51, "A.13": 36, "A.14": 38, "A.15": 45,
    "A.16": 41, "A.17": 42, "A.18": 50,
}  # fmt: skip

ROUNDED_OTHERWISE = {
    *(("A.10", name, BASELINE_VALUES[name]) for name in BASELINE_VALUES if name != "r_s"),
    *(("A.11", name, BASELINE_VALUES[name]) for name in BASELINE_VALUES if name != "r_s"),
    ("A.11", "d_theta_pc_deg", 5.0),
    ("A.12", "r_A", 0.05),
    ("A.13", "d_theta_pc_deg", 20.0),
    ("A.15", "r_bp", 0.9),
    ("A.15", "d_theta_pc_deg", 40.0),
}
"""Rows whose printed share and volume do not agree to the last digit; the module names them."""


def test_all_rows_are_there():
    assert {table.name: table.size for table in TABLES} == COUNTS
    assert sum(table.size for table in TABLES) == 468
    assert [len(row) for row in TABLES[7].rows.values()] == [12, 6, 7, 7, 6, 7]


@pytest.mark.parametrize(
    ("name", "bound", "value", "share", "volume"),
    [
        ("A.8", "r_B", 0.06, 13.2, 0.121),
        ("A.9", "r_bp", 0.7, 8.7, 0.088),
        ("A.9", "r_B", 0.02, 38.5, 0.391),
        ("A.9", "r_B", 0.03, 8.9, 0.091),
        ("A.10", "d_theta_bp_deg", 40, 10.9, 0.111),
        ("A.11", "r_pc", 0.01, 97.0, 0.985),
        ("A.11", "r_pc", 0.2, 97.0, 0.983),
        ("A.11", "d_theta_bp_deg", 40, 16.4, 0.166),
        ("A.12", "d_theta_bp_deg", 30, 0.003, 0.003),
        ("A.12", "d_theta_pc_deg", 20, 43.5, 35.772),
        ("A.12", "r_A", 0.1, 48.8, 40.207),
        ("A.12", "r_B", 0.1, 30.3, 24.926),
        ("A.13", "r_B", 0.02, 14.5, 0.147),
        ("A.14", "r_A", 0.1, 40.2, 0.407),
        ("A.15", "r_bp", 1.0, 35.2, 28.976),
        ("A.15", "r_pc", 0.3, 76.4, 62.865),
        ("A.16", "r_A", 0.1, 0.2, 0.002),
        ("A.16", "d_theta_pc_deg", 50, 88.5, 0.897),
        ("A.17", "d_theta_bp_deg", 50, 5.6, 0.057),
        ("A.18", "r_B", 0.4, 51.5, 42.427),
        ("A.18", "r_pc", 0.5, 94.029, 77.414),
    ],
)
def test_single_entries(name, bound, value, share, volume):
    (table,) = (table for table in TABLES if table.name == name)
    assert table.rows[bound][value] == share
    assert table.volumes[bound][value] == volume


def test_every_row_of_bounds_starts_at_the_baseline_and_falls():
    for table in TABLES:
        bounds = set(BASELINE_VALUES) - (set() if table.robot == "planar" else {"r_s"})
        assert set(table.rows) == bounds
        assert len({next(iter(row.values())) for row in table.rows.values()}) == 1
        for name, row in table.rows.items():
            assert next(iter(row)) == BASELINE_VALUES[name]
            assert list(row) == sorted(row)
            assert list(row.values()) == sorted(row.values(), reverse=True)
            volumes = list(table.volumes[name].values())
            assert volumes == sorted(volumes, reverse=True)


def test_shares_are_those_of_the_printed_volumes():
    otherwise = set()
    for table in TABLES:
        for name, row in table.rows.items():
            for value, share in row.items():
                volume = table.volumes[name][value]
                # Half of the last printed digits: 0.1 points, 0.001 m^2 or m^3.
                if abs(100.0 * volume / table.full - share) > 0.05 + 0.05 / table.full + 1e-9:
                    otherwise.add((table.name, name, value))
    assert otherwise == ROUNDED_OTHERWISE


def test_an_error_of_exit_points_contains_a_shift_of_the_platform():
    bad = {(pair.table, pair.r_A, pair.r_bp) for pair in nested_pairs() if pair.more}
    assert bad == {("A.15", 0.05, 0.05), ("A.18", 0.3, 0.3)}
    # With points that share one shift the same rows are the same sets, up to the draws.
    cables = load_robot("acrobot_large").cable_set().without_pulleys()
    shift = np.array([0.02, -0.01, 0.03])
    exits = replace(cables, p_WA=cables.p_WA - shift[:, np.newaxis])
    np.testing.assert_allclose(
        cable_jacobian(RigidTransform(shift), cables), cable_jacobian(RigidTransform(), exits)
    )


def test_printed_rows_that_a_common_shift_of_exit_points_cannot_give():
    less = [(pair.table, pair.r_A, pair.r_bp) for pair in covering_pairs() if pair.less]
    assert [pair for pair in less if pair[0] == "A.15"] == [
        ("A.15", 0.2, 0.25), ("A.15", 0.3, 0.5)
    ]  # fmt: skip
    assert ("A.12", 0.2, 0.25) in less
    upwards = replace(BY_NAME["A.11"], rows={"r_bp": {0.1: 30.0, 0.03: 97.0, 0.2: 30.5}})
    assert [(step.low, step.high) for step in steps_of([upwards]) if step.rises] == [(0.1, 0.2)]
