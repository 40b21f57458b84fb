"""Benchmark suites: many recordings, settings and seeds, resumable, on all cores or on a cluster, and their report."""
