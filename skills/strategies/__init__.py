"""What the strategies must remember and a machine cannot: declared as signals and actions over the world model."""

from skills.strategies import marks, places

__all__ = ["marks", "places"]
