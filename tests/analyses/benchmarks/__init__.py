"""Tests of `cdpr_drake.analyses.benchmarks`."""
