"""Hierarchical state machines, written as text: the engine, its registry and the language."""
