"""HTML reports: figures, tables and sections of a page."""
