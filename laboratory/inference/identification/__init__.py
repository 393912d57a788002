"""Identification of a track from a record of it: features, posterior, calibration."""
