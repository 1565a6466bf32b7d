"""Tests of `cdpr_drake.systems.monitoring`."""
