"""Tests of `cdpr_drake.statics`."""

"""Tests of `cdpr_drake.statics`."""

"""Tests of `cdpr_drake.statics`."""
