"""Tests of `cdpr_drake.equilibria`."""
