"""Tests of the compiled core against Pinocchio, finite differences and the NumPy oracle."""
