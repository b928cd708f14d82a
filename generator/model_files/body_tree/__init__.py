"""Models of other programs on their way in: XML, a tree of bodies, then a figure."""
