"""The baseline of all comparisons."""

from gaplab.services.core.strategies.simulated_fit import SimulatedFit


class Direct(SimulatedFit):
    """Evolution in reality itself: the fitness that a perfect simulator would give.

    It takes no samples and tunes nothing; each of its evaluations would be a real one. An experiment of this strategy
    is iteration 0 of the algorithm, with reality as the simulator.
    """

    name = "direct"
    source = "Paper, section 3: 1.33 on average, standard deviation 0.10"
    takes_samples = False
    in_reality = True
