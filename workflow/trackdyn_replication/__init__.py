"""The replication: claims of Wang et al. (2023), and whether the simulator shows them."""
