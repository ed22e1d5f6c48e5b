"""What the page shows: stored studies, lifetimes, live runs, papers and presets."""
