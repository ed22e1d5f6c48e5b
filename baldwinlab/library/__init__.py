"""Parts that come with the package beside those of the first paper: each a file as a user's own would be.

A file is a family: its parts, each with its source and its plain oracle. `experiment/choices.py` lists them by name.
"""
