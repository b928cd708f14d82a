"""Exudyn's model of a figure: bodies, joints, springs and contacts, and its accelerations."""
