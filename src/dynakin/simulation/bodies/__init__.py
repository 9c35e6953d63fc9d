"""Simulated persons: segments, coordinates and the subjects drawn around a table."""
