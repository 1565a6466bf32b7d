"""Tests of `cdpr_drake.geometry`."""
