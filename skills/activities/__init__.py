"""The motion skills, one module each; ``skills.catalogue`` lists them all."""
