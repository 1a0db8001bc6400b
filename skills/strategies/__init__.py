"""What the strategies must remember and a machine cannot: signals and actions over the world model."""
