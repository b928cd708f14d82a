"""Claims about curves and motion, each measured and drawn."""
