"""Populations that walk on a line of positions with peaks and valleys of fitness."""
