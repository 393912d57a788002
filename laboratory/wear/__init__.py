"""Wear that changes the geometry: work of friction over the contour, less material there, the same drive again."""
