"""Tests of `cdpr_drake.vision`."""
