"""Tests of cdpr_drake: one file per module, mirroring the folders of the package."""
