"""The study what-guides: is it learning, noise or time that guides evolution."""
