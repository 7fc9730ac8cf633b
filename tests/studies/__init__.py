"""Studies: how well the methods reach what they promise, with more trials than a test can spend."""
