"""Robot models (URDF)."""
