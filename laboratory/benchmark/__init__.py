"""A benchmark for multibody codes: closed chains, rolling contact, impacts on teeth."""
