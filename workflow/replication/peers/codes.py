"""Names of the codes that are compared, as tables have them."""

OURS, PEER, OWN = "trackdyn", "exudyn", "mujoco, contact of its own"
