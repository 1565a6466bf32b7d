"""Sections of `sensors` that look at the world or at motion: laser, depth camera, head, wheels."""
