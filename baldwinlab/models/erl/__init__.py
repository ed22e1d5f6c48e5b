"""The model of evolutionary reinforcement learning (ERL), in a population without generations.

An inherited evaluation network trains the action network of an agent.

`world` has the cells, plants and carnivores. `agents` has the senses, learning and reproduction of
agents. `simulation` simulates a population until it is extinct. `model` has the settings and
records: the entire history of a population is one lifetime of an agent of the package.

The thresholds, damages and rates are not in the paper. They are settings here, with our defaults.

References
----------
D. Ackley and M. Littman, "Interactions between learning and evolution", Artificial Life II (1991),
pp. 487-509.
"""
