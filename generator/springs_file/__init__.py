"""Springs files: TOML with places, laws by name, bound to the joints of a figure."""
