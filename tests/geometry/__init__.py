"""Tests of `cdpr_drake.geometry`."""

"""Tests of `cdpr_drake.geometry`."""
