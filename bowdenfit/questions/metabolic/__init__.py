"""What walking costs with and without a device: a study's own numbers looked at again. Knows nothing of cables."""
