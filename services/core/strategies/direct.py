"""The baseline that every strategy is measured against."""

from gaplab.services.core.strategies.simulated_fit import SimulatedFit


class Direct(SimulatedFit):
    """Evolution in reality itself: the fitness that a perfect simulator would lead to.

    It takes no samples and tunes nothing; every one of its evaluations would be a real one. An experiment of this
    strategy is iteration 0 of the algorithm, with reality in the place of the simulator.
    """

    name = "direct"
    source = "Paper, section 3: 1.33 on average, standard deviation 0.10"
    in_reality = True
