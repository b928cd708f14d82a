"""Figures that come with the program, read by their names."""
