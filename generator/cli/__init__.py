"""The command `mover`: one module for each subcommand."""
