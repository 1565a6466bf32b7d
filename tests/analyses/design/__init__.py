"""Tests of `cdpr_drake.analyses.design`."""

"""Tests of `cdpr_drake.analyses.design`."""
