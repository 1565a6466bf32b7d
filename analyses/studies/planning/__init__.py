"""The study of planned motions: time-optimal along ten paths, against a convex program of its own.

The convex program shares nothing with the planner but the limits.
"""
