"""What a record says about the track that made it: features, posterior, calibration."""
