"""How large a push has to be for what is asked of it: one number for each question, wherever it is asked."""

from __future__ import annotations

UNLOADED_N = 10.0
"""Push below which a plate is empty: a few times the noise of the usual plates (1 to 3 N), and small against the errors
that its centre of pressure has there (1 N m of noise moves it by 0.1 m)."""
LOADED_N = 20.0
"""Push from which a plate, or a foot, is loaded: its centre of pressure is then known to a few cm (1 N m: 5 cm), which
is what it takes to say which foot presses, or where a force acts."""
NOISE_N = 3.0
"""The noise of the usual plates: what reads less is at zero."""
JUDGED_N = 50.0
"""Push from which something is said of a plate: a load where no foot stands, a force beyond friction, standing. What is
lighter may be a cable, a step on the edge, a drift; no offset of a plate in order reaches it."""
LASTING_PULL = 0.02
"""Part of a recording in which a plate may pull by more than that: edges that ring, single samples."""
MOST_OFFSET_N = 2.0 * JUDGED_N
"""What a plate reads beside the load, at most: a press that stays below it may be nobody's, and shows no place."""
BEARS_N = 200.0
"""What plates push together on average, while loaded, from which they bear a person and not a hand or a heel."""
