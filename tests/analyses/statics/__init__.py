"""Tests of `cdpr_drake.analyses.statics`."""

"""Tests of `cdpr_drake.analyses.statics`."""
