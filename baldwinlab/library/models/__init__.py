"""Models of other kinds than the foragers of MiniWorld, one or two of a paper: founders, lives, payoff, measures, views."""
