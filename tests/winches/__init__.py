"""Tests of `cdpr_drake.winches`."""
