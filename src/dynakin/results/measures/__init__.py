"""What is read from an estimate: fit, consistency, power, symmetry, cycles, events."""
