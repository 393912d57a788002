"""The laboratory: parameters from records, searches for rigs: studies that the replication does not need."""
