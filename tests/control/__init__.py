"""Tests of `cdpr_drake.control`."""
