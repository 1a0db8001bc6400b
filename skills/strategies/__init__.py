"""The memory of strategies, which a machine cannot hold: signals and actions over the world model."""
