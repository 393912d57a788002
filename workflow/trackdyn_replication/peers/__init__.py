"""Exudyn, an independent multibody code instead of the commercial one that the paper compares itself with."""

OURS, PEER = "trackdyn", "exudyn"  # names of the codes, as tables have them
