"""The replication: what Wang et al. (2023) claim, and whether the simulator shows it."""
