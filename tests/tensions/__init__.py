"""Tests of `cdpr_drake.tensions`."""
