"""Simulated sensors: markers on moving skin and force plates, with the errors of both."""
