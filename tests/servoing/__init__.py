"""Tests of `cdpr_drake.servoing`."""
