"""Tests of `cdpr_drake.bridge`."""
