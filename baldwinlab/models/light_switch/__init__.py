"""The model of a robot that must switch on a lamp and then stay near it.

    baldwinlab reproduce floreano-urzelai-2000

The arena is a square with a side of 1. A stripe on a wall marks the switch. The lamp is lit from
the first step in which the robot is within 0.2 of the stripe. Fitness is the share of the steps of
a lifetime that the robot spends within 0.2 of the lit lamp. The robot senses the lit lamp in front,
left, behind and right, the stripe half left, ahead and half right, and walls ahead, left and right.
All neurons are logistic. Each neuron receives all inputs and the previous values of all neurons.
The last two neurons drive the wheels.

`encoding` is the genetic encoding. A gene has five bits.

- `neurons` and `synapses`: each neuron or each synapse has a gene with a sign (1 bit), one of four
  learning rules (2 bits) and a rate (2 bits). The weights are small and random at birth. They
  change in each step, within [0, 1]. The rule and the rate of a neuron apply to its incoming
  synapses. The sign of a neuron applies to its outgoing synapses.
- `strengths`: each synapse has a gene with a sign (1 bit) and a strength (4 bits). The weights do
  not change.

In each generation, each agent has an additional lifetime in a changed world, which does not affect
its fitness.

The changes follow Urzelai and Floreano 2001. Their numbers are from memory. The geometry, the
senses, the number of neurons and the sizes of the changes are our choice.

`model` has the settings and the genetic encodings, and `lifetimes` the arena and the neurons.

References
----------
D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and behavioral
fitness", Neural Networks 13 (2000).
J. Urzelai and D. Floreano, "Evolution of adaptive synapses", Evolutionary Computation 9 (2001).
"""
