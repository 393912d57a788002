"""The laboratory: parameters from records, searches, ensembles, wear, and other studies that the replication does not need."""
