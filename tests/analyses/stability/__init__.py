"""Tests of `cdpr_drake.analyses.stability`."""
