"""Containers of numbers and text, whatever they hold: npz, MATLAB, bags, text tables, YAML, TOML; atomic writing."""
