"""Evaluation of a study in stages: tuning, confirmation and specification curve."""
