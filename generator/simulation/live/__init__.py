"""Simulation step by step of a figure that changes in between."""
