"""Tests of `cdpr_drake.systems.remote`."""

"""Tests of `cdpr_drake.systems.remote`."""
