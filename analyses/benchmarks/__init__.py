"""Timings as ratios within one run, one group a file; `BENCH_GROUPS` is their table."""
