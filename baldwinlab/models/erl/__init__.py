"""Evolutionary reinforcement learning: agents inherit what is good, and learn by it what to do, in a world without generations.

`world` is the ground and what grows and hunts on it, `agents` how an agent senses, learns and is bred, `model` makes of a whole
population, from its founders to its last, the life that the laboratory knows.

Source: D. Ackley and M. Littman, "Interactions between learning and evolution", Artificial Life II (1991), pp. 487-509. Its
thresholds, damages and rates were not printed: they are fields here, and ours.
"""
