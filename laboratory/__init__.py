"""The laboratory: parameters from records, searches, ensembles, wear: studies that the replication does not need."""
