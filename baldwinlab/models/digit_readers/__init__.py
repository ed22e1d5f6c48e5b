"""The model of networks that learn to classify digits, with few or many trials during life.

    baldwinlab reproduce keesing-stork-1991

A digit has 5 by 7 pixels. Each pixel is inverted with the probability `noise`. A genome has the
weights of a network of logistic units: 35 pixels, hidden units and ten outputs. A weight has 16
levels from -2 to 2, which is four bits. During life, a network is trained on digits from a set of a
hundred, by gradient descent on the squared error. Then it is tested on a hundred other digits. Both
sets are the same for all agents of a run. Fitness is the share of digits that are classified
correctly. All networks have the same number of trials, or each has a random number between zero and
twice the mean.

Reproduction follows the patent of Keesing and Stork. The digits, sizes and rates are our choice.

`model` has the settings and records, `digits` the images, `training` the networks, and `variation`
the reproduction.

References
----------
R. Keesing and D. G. Stork, "Evolution and learning in neural networks: the number and distribution
of learning trials affect the rate of evolution", Advances in Neural Information Processing Systems
3 (1991).
R. Keesing and D. G. Stork, US patent 5,245,696.
"""
