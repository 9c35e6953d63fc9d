"""Many trials at once: batches and tunings, over all cores or a cluster."""
