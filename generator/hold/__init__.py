"""Can a person hold this? Moments of a posture with loads, beside the strengths of its joints."""
