"""`python -m baldwinlab` is the command line."""

from baldwinlab.cli import main

main()
