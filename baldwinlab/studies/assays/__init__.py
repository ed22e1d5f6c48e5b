"""Assays: re-simulate the genomes of a stored study under changed conditions and measure them."""
