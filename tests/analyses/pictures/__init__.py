"""Tests of `cdpr_drake.analyses.pictures`."""
