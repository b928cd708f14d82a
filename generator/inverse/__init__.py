"""Inverse dynamics of measured motions: joint moments, the passive share of them, markers."""
