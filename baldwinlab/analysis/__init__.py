"""What a study says: labelled arrays in, labelled arrays and verdicts out. It never imports the engine."""
