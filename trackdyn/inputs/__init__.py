"""Input and output: files, YAML, validation, quantities with units, and error messages."""
