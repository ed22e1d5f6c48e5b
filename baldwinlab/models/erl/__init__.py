"""Evolutionary reinforcement learning: inherited evaluations train actions, without generations.

`world` has the cells, plants and carnivores. `agents` has the senses, learning and reproduction of
agents. `model` presents the entire history of a population as one lifetime of the laboratory.

The thresholds, damages and rates are not in the paper. They are settings here, with our defaults.

References
----------
D. Ackley and M. Littman, "Interactions between learning and evolution", Artificial Life II (1991),
pp. 487-509.
"""
