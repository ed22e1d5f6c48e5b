"""The learning rule of the first paper as a custom part, with identical results.

    baldwinlab run evo+self-taught/A --part examples/parts/self_taught_again.py \
        --set learning.rule=self-taught-again

In each step, backpropagation moves the outputs of the action module toward the outputs of the
reinforcement module, which is inherited and does not learn.

Source: Le 2019, "The Self-taught neural architecture".
"""

from baldwinlab.parts import LearningRule, Training, backward, get


class SelfTaughtAgain(LearningRule, name="self-taught-again"):
    """Backpropagation toward the outputs of the reinforcement module."""

    modules = ("action", "reinforcement")
    # The drift control changes weights as much as self-teaching does.
    supports_drift_control = True

    @staticmethod
    def learn(part, model, state, step, lane):
        rate = get(state.rate, 0, lane)
        training = Training(rate, state.weights, state.activations, state.errors, state.targets)
        backward(state.network, training, lane)

    @staticmethod
    def oracle(part, agents, agent, naive):
        """Compute the same in plain Python. `check` compares it with the compiled hook."""
        target = naive.think(agent.reinforcement_module, agent.inputs)
        naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)
