"""Tests of `cdpr_drake.textures`."""
