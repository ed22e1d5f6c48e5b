"""The papers beside each other: of all whose studies are stored, what came of their claims, and whether it is the Baldwin
effect."""
