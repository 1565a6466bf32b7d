"""Tests of `cdpr_drake.analyses.simulation`."""
