"""Comparison of a simulation with a field test: records of data loggers, their axes, and their differences."""
