"""Tests of `cdpr_drake.analyses.runs`."""
