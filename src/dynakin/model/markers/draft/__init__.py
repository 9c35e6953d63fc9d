"""A draft of a marker set from a recording: places guessed by the markers' names, and by where they lie."""
