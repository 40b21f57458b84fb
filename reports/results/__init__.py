"""Results as plain data: the models of `summary.json` and `comparison.json`, how they are filled, and their reader."""
