"""Proofs about all runs of a machine, without a bound on their length; a violation is shown by a run."""
