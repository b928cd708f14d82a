"""Contact of a figure with props and with itself: scene, spheres, capsules, forces and record."""
