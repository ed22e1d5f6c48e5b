"""Whole studies: what Python says in a line, and what each command of the command line does."""
