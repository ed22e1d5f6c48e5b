"""Benchmarks: baldwinlab compared with what a user would pick instead. See README.md in this folder."""
