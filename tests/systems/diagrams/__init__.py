"""Tests of `cdpr_drake.systems.diagrams`."""
