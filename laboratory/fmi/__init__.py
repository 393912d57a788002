"""A track as a unit for co-simulation by the FMI standard."""
