"""User-specified repairs, which take precedence over what the diagnosis estimates."""
