"""Tests of `cdpr_drake.models`."""
