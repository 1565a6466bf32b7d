"""Tests of `cdpr_drake.cli`."""
