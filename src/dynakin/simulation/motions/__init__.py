"""Simulated motions, by name or from a coordinates file."""
