"""Parts that come with the package beside those of the first paper: each a file as a user's own would be.

A file here is a family of parts of foragers, each with its source and its plain oracle; `neat/` holds networks that grow, and
`models/` models of other kinds, one or two of a paper. `experiment/choices.py` lists all of them by name.
"""
