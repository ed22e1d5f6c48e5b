"""NEAT, neuroevolution of augmenting topologies, with historical marks and species.

`genome` has the array format of networks, `mutation` makes children, and `species` assigns networks
to species. `operators` has the variation `neat` and the selection `species`.

References
----------
K. O. Stanley and R. Miikkulainen, "Evolving neural networks through augmenting topologies",
Evolutionary Computation 10 (2002), sections 3 and 4.1.
"""
