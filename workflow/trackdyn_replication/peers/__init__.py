"""Exudyn, an independent multibody code instead of the commercial one that the paper compares itself with."""
