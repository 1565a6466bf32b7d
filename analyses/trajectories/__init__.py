"""Motions from rest to rest, and what they ask of the cables."""
