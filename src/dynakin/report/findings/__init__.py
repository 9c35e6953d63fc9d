"""What a reader should know before using a run, by what it is about."""
