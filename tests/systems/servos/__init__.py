"""Tests of `cdpr_drake.systems.servos`."""
