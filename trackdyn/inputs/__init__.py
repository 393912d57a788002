"""What every input passes through: files, YAML, validation, quantities with units, and the sentences of refusals."""
