"""Tests of `cdpr_drake.analyses.simulation`."""

"""Tests of `cdpr_drake.analyses.simulation`."""
