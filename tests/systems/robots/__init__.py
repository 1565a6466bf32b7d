"""Tests of `cdpr_drake.systems.robots`."""
