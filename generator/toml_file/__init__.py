"""TOML files: values with the places where they stand, their bounds, and their writing."""
