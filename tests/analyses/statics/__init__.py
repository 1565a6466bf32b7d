"""Tests of `cdpr_drake.analyses.statics`."""
