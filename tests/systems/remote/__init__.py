"""Tests of `cdpr_drake.systems.remote`."""
