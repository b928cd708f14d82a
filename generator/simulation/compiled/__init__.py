"""A compiled evaluation of the equations of motion, and their explicit integration."""
