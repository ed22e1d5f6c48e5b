"""Self-teaching, written as a user would: the paper's own rule under another name, and to the same bits.

    baldwinlab run evo+self-taught/A --part examples/parts/self_taught_again.py --set learning.rule=self-taught-again

In every step, one step of backpropagation moves what the action module answers to what was sensed towards the answer of the
reinforcement module, which is inherited and never learns (Le 2019, "The Self-taught neural architecture").
"""

from baldwinlab.parts import LearningRule, backward, get


class SelfTaughtAgain(LearningRule, name="self-taught-again"):
    """Backpropagation towards what the reinforcement module answers."""

    modules = ("action", "reinforcement")
    supports_drift_control = True  # the control `drift` goes as far as self-teaching would

    @staticmethod
    def learn(part, model, state, step, lane):
        rate = get(state.rate, 0, lane)
        backward(
            state.network, rate, state.weights, state.activations, state.errors, state.targets, lane
        )

    @staticmethod
    def oracle(part, agents, agent, naive):
        """The same in plain Python, one number after another, as `check` holds it against the compiled hook."""
        target = naive.think(agent.reinforcement_module, agent.inputs)
        naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)
