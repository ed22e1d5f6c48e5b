"""Tests with killed processes, damaged files, invalid inputs and floods of requests.

See docs/explanation/reproducibility.md. `make faults` runs all of them, `make test` a sample.
"""
