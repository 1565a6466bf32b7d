"""Tests of `cdpr_drake.analyses.visualization`."""
