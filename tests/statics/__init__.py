"""Tests of `cdpr_drake.statics`."""
