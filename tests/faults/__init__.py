"""Tests with killed processes, damaged files, odd inputs and floods: see docs/explanation/reproducibility.md.

`make faults` runs all of them, `make test` a sample.
"""
