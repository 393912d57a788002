"""What records and printed numbers say about the rig: unknown parameters, emulators, history matching."""
