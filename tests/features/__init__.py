"""Tests of `cdpr_drake.features`."""
