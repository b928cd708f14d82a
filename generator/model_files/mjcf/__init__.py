"""MuJoCo's models (MJCF)."""
