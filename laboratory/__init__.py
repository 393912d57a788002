"""The laboratory: parameters from records, searches for rigs, wear: studies that the replication does not need."""
