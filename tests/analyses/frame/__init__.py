"""Tests of `cdpr_drake.analyses.frame`."""
