"""Trust before driving: scenarios, generated tests, properties, mutation and coverage of machines, without a robot."""
