"""Tests of `cdpr_drake.systems.sensors`."""
