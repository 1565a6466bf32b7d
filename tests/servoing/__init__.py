"""Tests of `cdpr_drake.servoing`."""

"""Tests of `cdpr_drake.servoing`."""
