"""Strength: the largest torques of muscles about the axes of joints."""
