"""NEAT, neuroevolution of augmenting topologies: networks grow, are crossed by historical marks, and form species.

`graphs` is how a network is written into a genome, `growth` how children come of it, `species` who belongs together and how
species stand; `parts` makes of these a variation and a selection, and `oracle` does the same once more in plain Python.

Source: K. O. Stanley and R. Miikkulainen, "Evolving neural networks through augmenting topologies", Evolutionary Computation
10 (2002), sections 3 and 4.1.
"""
