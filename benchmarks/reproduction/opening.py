"""What the document says first: the question, and the words of the answers."""

OPENING = """# The paper's figures and claims

*A Comparison of Sampling Strategies for Parameter Estimation of a Robot Simulator* (Klaus, Glette and Tørresen, SIMPAR
2012) asks which controllers to try on a real robot, so that few trials tune its simulator. This page repeats its
experiment with another robot, other engines and, mostly, another optimizer, fewer evaluations and fewer repetitions
([what differs](#what-differs-from-the-paper)). As in the paper, *reality* is a simulator whose friction and restitution
are hidden."""

WORDS = """A **sample** is a controller that a strategy selects and reality measures. After each number of samples, a
simulator is tuned on them, and the controller that is searched in it is **transferred** to reality. The larger of its
fitness and the best sample's is the **recorded** fitness. All fitness is a ratio to ***direct***: the mean fitness of
many controllers, each from a search of its own in reality itself, with as many evaluations as the search for a
transferred controller. The six strategies choose the samples: *simulated fit* takes the fittest controller of the tuned
simulator; *unique* keeps it away from earlier samples; *informative* takes the one on which 20 simulators disagree
most; *simulated fit and informative* adds both aims; *random* draws controllers, and *known fit* draws them around one
that walks."""

EXTENSION = """*An extension*: the paper has one engine for simulators and reality. Here no setting of the simulators is
exactly right. So a claim that fails here is not contradicted where there is one engine, and C1 may hold by chance."""
