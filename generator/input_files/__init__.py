"""Files beside a figure: loads, drives, moments, poses, links, scenes."""
