"""Named tuples of the kernels: constants of a run, its state, the arrays of a step, the record that it fills."""
