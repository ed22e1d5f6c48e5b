"""Benchmarks that compare baldwinlab with alternatives: see README.md in this folder."""
