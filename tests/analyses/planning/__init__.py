"""Tests of `cdpr_drake.analyses.planning`."""
