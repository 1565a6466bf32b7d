"""Tests of `cdpr_drake.estimation`."""
