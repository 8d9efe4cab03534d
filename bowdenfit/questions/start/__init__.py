"""From files that no description names, and answers to what they do not say, to a cable.toml."""
