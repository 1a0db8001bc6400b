"""Other notations: SCXML, the library transitions, and diagrams."""
