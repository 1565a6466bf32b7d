"""Machines whose cables run between any frames of a plant."""
