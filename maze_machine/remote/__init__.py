"""A running machine that people and programs elsewhere look at and send events to, over the network."""
