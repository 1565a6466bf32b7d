"""Tests of `cdpr_drake.systems.cameras`."""
