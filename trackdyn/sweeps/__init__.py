"""Many scenes: designs, and their results a row each."""
