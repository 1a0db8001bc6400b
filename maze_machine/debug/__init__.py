"""A debugger for machines: their runs step by step, forwards and backwards, as editors show them."""
