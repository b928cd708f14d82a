"""The plates, one subject a module."""
