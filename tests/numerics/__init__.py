"""Tests of `cdpr_drake.numerics`."""
