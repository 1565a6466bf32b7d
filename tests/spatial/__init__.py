"""Tests of `cdpr_drake.spatial`."""
