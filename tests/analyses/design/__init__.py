"""Tests of `cdpr_drake.analyses.design`."""
