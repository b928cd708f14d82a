"""Published numbers: tables with their references, ranges of motion, the shoulder's rhythm."""
