"""Tests of `cdpr_drake.analyses.comparisons`."""
