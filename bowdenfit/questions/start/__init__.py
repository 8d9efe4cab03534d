"""Start a data set: write a cable.toml from measured files, and from answers to what they do not say."""
