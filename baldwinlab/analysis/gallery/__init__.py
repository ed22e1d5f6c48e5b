"""The gallery: all papers with a stored study, their verdicts, and their Baldwin effects."""
