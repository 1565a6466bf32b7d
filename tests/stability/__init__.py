"""Tests of `cdpr_drake.stability`."""
