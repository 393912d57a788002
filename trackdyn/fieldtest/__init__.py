"""A simulated run beside a field test: records of data loggers, their axes, and how they compare with a recording."""
