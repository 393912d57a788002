"""Tools that the answer and identification share: unknown parameters of a rig, and emulators of its runs."""
