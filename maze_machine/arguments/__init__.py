"""Arguments of commands: options, their completion, and values written as in the language."""
