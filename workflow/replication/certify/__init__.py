"""Tools to certify a replication with: the manifest of a run and its comparison with another."""
