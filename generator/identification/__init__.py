"""Identification: springs of a figure from a measured motion."""
