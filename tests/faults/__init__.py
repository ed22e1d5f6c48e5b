"""What is done to the laboratory to break it: docs/explanation/reproducibility.md. `make faults` does all of it, `make test` a sample."""
