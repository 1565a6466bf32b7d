"""Tests of `cdpr_drake.stability.verdicts`."""
