"""Data of the kernels: constants of a run, its state, the arrays of a step, the record that it fills.

Plain named tuples of numbers and arrays, so that one set serves every step and nothing is allocated while
the time runs. A feature that a scene does without is None, and its code is left out when a kernel is compiled.
"""
