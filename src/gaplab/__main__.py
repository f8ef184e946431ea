"""The `gaplab` command: `python -m gaplab`."""

from gaplab.api.commands.cli import main

if __name__ == "__main__":
    main()
