"""Comparison of motions: what differs most between them, from when on, and a page of all."""
