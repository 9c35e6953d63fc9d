"""From a recording to a folder of results."""
