"""The model of foragers on a grid, which learn from a teacher or from additional outputs.

    baldwinlab reproduce nolfi-parisi-1993

A grid of 10 by 10 cells has ten items of food and a single agent. An agent eats an item by entering
its cell. The four inputs are the angle of the nearest item relative to the heading, the distance of
this item, and the two bits of the next action. From these inputs, the network computes the action
that follows the next action: stay (00), turn right (01), turn left (10) or go ahead (11). A
lifetime has several environments with a number of steps each. Fitness is the mean food per
environment.

The setting `learning` selects the targets of learning:

- none;
- `auto-teaching`: the outputs of an inherited teaching module, for the outputs of the action;
- `prediction`: the next angle and distance, for two additional outputs;
- `random-targets`: random numbers, for the two additional outputs, as a control.

The world, the lifetimes, the evolution and the prediction follow Nolfi et al. 1994. The numbers of
both papers are from memory. Our choices are as follows: a move off the grid has no effect; an agent
begins in any cell with any heading; without food, the angle is 0 and the distance is 1.

`model` has the settings and records. `lifetimes` simulates the environments of agents, on the grid
of `grid` and with the networks of `network`. `variation` has the mutation of both papers.

References
----------
S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive Behavior
3 (1994).
S. Nolfi and D. Parisi, "Auto-teaching: networks that develop their own teaching input", ECAL 93.
"""
