"""The model of agents that learn which color means food, with smell as a noisy teacher.

    baldwinlab reproduce todd-miller-1991

An agent is in one of two patches. In one patch, red is food and green is poison; in the other it is
the reverse. Items arrive one by one. An item is food with probability 1/2. Food smells sweet, and
poison smells sour, with the probability `cue_accuracy`. An agent eats an item or passes. It gets no
feedback: only selection depends on the eaten items.

A network has a few units. A unit is a sensor of red, green, sweet or sour, a hidden unit or the
motor unit. Values are 1 or -1. The agent eats if the input of the motor unit is above 0. A link is
fixed or Hebbian. A Hebbian link changes by `learning_rate` times the product of the values at its
two ends, within [-1, 1]. Therefore, a fixed link from smell can train a Hebbian link from color.

The idea, the patches and the few units follow Todd and Miller 1991, the rule follows Hebb 1949. The
constants of the paper are not known, so the constants here are our choice.

`model` has the settings and records, `genes` the alleles and the reproduction, and `lifetimes` the
items and the networks.

References
----------
P. M. Todd and G. F. Miller, "Exploring adaptive agency II: simulating the evolution of associative
learning", From Animals to Animats (1991).
D. O. Hebb, The Organization of Behavior (1949).
"""
