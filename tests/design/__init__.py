"""Tests of `cdpr_drake.design`."""
