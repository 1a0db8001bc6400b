"""A debugger for machines: runs step by step, forwards and backwards, in editors."""
