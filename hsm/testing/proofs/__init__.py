"""Proofs about all runs of a machine, without a bound on their length; what is violated is shown by a run."""
