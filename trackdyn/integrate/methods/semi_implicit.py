"""Semi-implicit Euler: velocities with the accelerations at the start of the step, places with the new velocities."""

from trackdyn.integrate.method import Method

METHOD = Method(order=1, oscillation=2.0, decay=2.0)
