"""What is done to the laboratory to break it: docs/reliability.md. `make faults` does all of it, `make test` a sample."""
