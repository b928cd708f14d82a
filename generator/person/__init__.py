"""A person of today: a figure scaled to sex, stature, mass and measured dimensions."""
