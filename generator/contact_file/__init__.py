"""Parts of a body that touch props as wholes, and their files."""
