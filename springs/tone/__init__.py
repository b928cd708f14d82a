"""Tone of muscles: torques that hold a posture or right a segment, as shares of strength."""
