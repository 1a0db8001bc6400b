"""The chart as data: types, expressions, declarations, diagnostics and the registry."""
