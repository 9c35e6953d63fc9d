"""One writer a file of the output folder."""
