"""Parts that belong to this paper only: its printed numbers, its claims and their evidence, its figures and tables."""
