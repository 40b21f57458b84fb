"""The folders whose packages are measured."""

ROOMS = ("geometry", "data", "ekf", "smoother", "compare", "reports")
