"""Repair of a recording by what the diagnosis estimates."""
