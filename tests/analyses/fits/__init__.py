"""Tests of `cdpr_drake.analyses.fits`."""
