"""Runs, studies and benchmarks: each returns a result object and knows its table and figures."""
