"""Every rig that the printed numbers allow: history matching, what holds in all of them, the choice of a ring."""
