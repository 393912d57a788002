"""Which rigs the printed numbers exclude: history matching, what the least excluded show, the choice of a ring."""
