"""The passive moment of a joint about one axis as a curve, beside published ones."""
