"""One engine a module: how it is built from a tree, and how it moves it."""
