"""One experiment at many points of the space of its fields; docs/reference/sweeps.md."""
