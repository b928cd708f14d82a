"""A figure in a pose: where its segments are."""
