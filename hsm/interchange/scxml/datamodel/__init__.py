"""The data model of charts in SCXML: a safe subset of ECMAScript's and Python's expressions, and what changes data."""
