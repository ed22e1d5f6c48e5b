"""Pages in one file, and other files that the lab writes."""
