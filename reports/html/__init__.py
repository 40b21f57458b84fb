"""The pages: one HTML file each, that opens offline."""
