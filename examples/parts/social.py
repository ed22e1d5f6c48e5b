"""A learning rule: agents imitate the agent that has eaten most.

    baldwinlab run evo/A --part examples/parts/social.py --set learning.rule=social \
        learning.social.least=3

The per-world hook `observe_others` determines the best agent, because it may read all agents of a
world.
The per-agent hook `learn` then changes the weights of each agent.

Source: R. Boyd and P. J. Richerson, Culture and the Evolutionary Process (1985).
"""

from baldwinlab.parts import Field, LearningRule, Training, backward, get


class Social(LearningRule, name="social"):
    """Backpropagation toward the outputs of the agent that has eaten most."""

    least: int = Field(
        1, ge=1, le=1_000_000, description="Minimum number of items that the best agent has eaten."
    )

    @staticmethod
    def observe_others(part, model, state, world, step):
        first = world * model.agents
        best = first
        most_eaten = -1
        for lane in range(first, first + model.agents):
            eaten = 0
            for region in range(state.eaten_in_life.shape[0]):
                eaten += state.eaten_in_life[region, lane]
            if eaten > most_eaten:
                best = lane
                most_eaten = eaten
        actions = state.targets.shape[0]
        first_output = state.activations.shape[0] - actions
        for lane in range(first, first + model.agents):
            # An agent whose targets are its own outputs does not learn.
            teacher = best if most_eaten >= part.least else lane
            for output in range(actions):
                activation = state.activations[first_output + output, teacher]
                state.targets[output, lane] = activation

    @staticmethod
    def learn(part, model, state, step, lane):
        rate = get(state.rate, 0, lane)
        training = Training(rate, state.weights, state.activations, state.errors, state.targets)
        backward(state.network, training, lane)

    @staticmethod
    def oracle(part, agents, agent, naive):
        # `max` returns the first of equal agents.
        best = max(agents, key=lambda candidate: candidate.eaten_in_life)
        target = (best if best.eaten_in_life >= part.least else agent).outputs
        naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)
