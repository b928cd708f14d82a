"""Studies: runs of one figure whose springs, masses, poses or surroundings vary."""
