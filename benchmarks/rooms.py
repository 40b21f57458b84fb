"""The folders whose packages are measured."""

ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare", "reports")
