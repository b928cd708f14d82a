"""Build a figure into an Exudyn system and simulate it; the only package that imports exudyn."""
