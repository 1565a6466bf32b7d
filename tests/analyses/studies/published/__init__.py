"""Tests of the room `published`."""
