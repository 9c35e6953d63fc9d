"""What is known at this moment, frame by frame: of the ground what `filter.ground` says of a whole recording, of the
noise what `filter.adapt` does."""
