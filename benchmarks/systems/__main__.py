"""Whether each system from elsewhere does here what its authors say: `python -m benchmarks.systems NAME …`.

Each check is a few studies at desk scale, and claims that are judged on them. A study is read from the folder of
studies if it is there as an archive, or else computed and kept there; an interrupted one goes on. `--smoke` tries the
studies at a size that shows nothing.

A claim holds if the 90 % interval of its difference is on its side of 0, fails if that is on the other side, and is
open otherwise. Repetitions are the unit; the interval is Welch's.
"""

from benchmarks.systems import cited, later  # noqa: F401 - each check registers itself
from benchmarks.systems.judging import SMOKE, SYSTEMS, asked


def main() -> None:
    """Print the claims of the systems that are named, or of all."""
    arguments = asked("python -m benchmarks.systems", __doc__, SYSTEMS)
    for name in arguments.names or SYSTEMS:
        print(f"{name}:")
        for claim in SYSTEMS[name].claims(arguments.folder, SMOKE if arguments.smoke else {}):
            print(claim)


if __name__ == "__main__":
    main()
