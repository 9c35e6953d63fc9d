"""Defaults of options that no configuration has: here, so that `--help` shows them without loading what uses them."""

CUTOFF_HZ = 6.0
"""Low-pass of slow movements without impacts (Winter 2009, section 3.4.4.3: 4 to 8 Hz by residual analysis)."""
HORIZON_S = 0.1
"""How far ahead `compare --unseen` looks."""
DELAY_S = 0.05
"""Longest wait of a live session for a packet that is missing or late."""
