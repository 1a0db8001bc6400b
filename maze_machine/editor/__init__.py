"""Editor features beyond the Language Server Protocol: the diagram of a file, the states of a live run."""
