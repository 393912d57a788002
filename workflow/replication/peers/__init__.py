"""Independent multibody codes in the place of the commercial one that the paper compares itself with."""
