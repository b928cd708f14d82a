"""The page in the browser: pose a figure, bend its curves, play its motion, let it fall."""
