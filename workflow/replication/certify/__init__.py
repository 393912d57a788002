"""What others certify a replication with: the manifest of a run, its comparison with another, a provenance crate."""
