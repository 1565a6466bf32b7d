"""Tests of `cdpr_drake.cables`."""
