"""A model fitted to one person: lengths, marker places, inertia and posture from a recording."""
