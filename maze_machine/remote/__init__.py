"""A running machine that other programs watch and operate over the network."""
