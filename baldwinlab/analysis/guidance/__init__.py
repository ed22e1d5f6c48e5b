"""Results of the study what-guides: effects, predictions and figures."""
