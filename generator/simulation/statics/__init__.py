"""Forces at rest, and the poses in which a figure rests."""
