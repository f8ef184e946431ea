"""Whether each system from elsewhere does here what its authors say: `python -m benchmarks.systems NAME …`.

Each check is a few studies at desk scale, and claims that are judged on them. A study is read from the folder of
studies if it is there as an archive, or else computed and kept there; an interrupted one goes on. `--smoke` tries the
studies at a size that shows nothing.

A claim holds if the 90 % interval of its difference is on its side of 0, fails if that is on the other side, and is
open otherwise. Repetitions are the unit; the interval is Welch's. All together are written to docs/systems.md.
"""

from pathlib import Path

from benchmarks.reproduction.results import table
from benchmarks.systems import cited, later  # noqa: F401 - each check registers itself
from benchmarks.systems.judging import FOLDER, SMOKE, SYSTEMS, asked


def main() -> None:
    """Print the claims of the systems that are named, or print all and write the page."""
    arguments, lines = asked("python -m benchmarks.systems", __doc__, SYSTEMS), []
    for name in arguments.names or SYSTEMS:
        print(f"{name}:")
        for claim in SYSTEMS[name].claims(arguments.folder, SMOKE if arguments.smoke else {}):
            print(claim)
            lines.append([name.replace("_", " "), claim.says, claim.verdict, claim.found])
    if not (arguments.names or arguments.smoke):
        text = (Path(__file__).parent / "systems.txt").read_text("utf-8")
        page = text.format(table=table(["system", "claim", "verdict", "found"], lines))
        (FOLDER.parent / "systems.md").write_text(page, "utf-8")


if __name__ == "__main__":
    main()
