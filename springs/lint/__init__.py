"""Doubts about curves: what a reader of a springs file should look at again."""
