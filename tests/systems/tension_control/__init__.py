"""Tests of `cdpr_drake.systems.tension_control`."""
