"""Tests of `cdpr_drake.systems.scenarios`."""
