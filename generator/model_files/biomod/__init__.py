"""The format of biorbd."""
