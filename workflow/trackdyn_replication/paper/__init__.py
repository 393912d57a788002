"""All that belongs to this one paper: its printed numbers, its claims and their evidence, its figures and tables."""
