"""The gallery: the verdicts of all papers whose studies are stored, and whether each has a Baldwin effect."""
