"""What is known of the ground at this moment, frame by frame: what `filter.ground` says of a whole recording."""
