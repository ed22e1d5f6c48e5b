"""The model of T-mazes in which the high reward moves, and of networks with plastic synapses.

    baldwinlab reproduce soltoggio-2008

A lifetime is a hundred trips. A trip goes from home along a corridor to a turning point, then left
or right, to an end of the maze. In the double maze, a trip passes two turning points. One end has a
reward of 1, the other ends have 0.2. The high reward moves once in a lifetime, near its middle. The
agent goes straight on if the output is within 1/3 of 0, otherwise right or left. A wrong action in
a corridor or at a turning point is a crash, which costs 0.4 and ends the trip. With `homing`, the
agent must also return home. Otherwise it loses 0.3.

Three inputs are 1 at a turning point, at an end, and at home. The fourth input is the reward, and
the fifth is always 1. The activation of a neuron is tanh(a / 2), where a is the weighted sum of the
inputs and of the latest values of the standard neurons. The modulatory neurons are updated first,
then the standard neurons, the output last. After each step, each synapse from an input or a
standard neuron with the activation x to a neuron with the activation y changes by

    tanh(m / 2) rate (A x y + B x + C y + D)

where m is the sum of the signals that the neuron receives from modulatory neurons. Without
modulatory neurons, the factor tanh(m / 2) is 1. Weights are limited to [-10, 10].

The rule, the rewards and the trips are from memory. Our choices are as follows. The number of
neurons is given and all neurons are connected; in the paper, neurons are inserted, duplicated and
deleted. Synapses from modulatory neurons do not change. Activations are reset after each trip (the
setting `memory`), so only weights carry information between trips. A position takes one step. All
agents of a generation of a run have the same maze.

`model` has the settings and records, and `trips` the mazes and the networks.

References
----------
A. Soltoggio, J. A. Bullinaria, C. Mattiussi, P. Duerr and D. Floreano, "Evolutionary advantages of
neuromodulated plasticity in dynamic, reward-based scenarios", ALIFE XI (2008).
"""
