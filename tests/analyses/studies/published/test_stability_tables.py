"""All rows of the servoing thesis' tables A.8 to A.18, as printed."""

import pytest

from cdpr_drake.analyses.studies.published.stability_tables import BASELINE_VALUES, TABLES

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
