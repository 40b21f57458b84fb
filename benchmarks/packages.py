"""The folders whose packages are measured."""

TOP = "package"
"""folder of the package itself"""
ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare", "reports")
