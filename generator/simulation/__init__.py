"""The only room that imports exudyn: a figure becomes a multibody system and runs."""
