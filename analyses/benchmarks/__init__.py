"""Timings as ratios within one run, one group a file; `BENCH_GROUPS` is their table."""

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS

__all__ = ["BENCH_GROUPS"]
