"""Runs and studies: each returns a result object and knows its table and figures."""
