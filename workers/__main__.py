"""`python -m workers serve`: run what is queued until told to stop."""

import logging
import signal
import sys
from threading import Event

from services.settings import Settings
from services.store.session import Store
from workers.cluster import cluster
from workers.supervisor import Supervisor


def main(arguments: list[str]) -> int:
    """Serve until SIGTERM or SIGINT; 2 if the command is not understood."""
    if arguments != ["serve"]:
        sys.stderr.write("usage: python -m workers serve\n")
        return 2
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    settings = Settings.from_environment()
    stop = Event()
    for signum in (signal.SIGTERM, signal.SIGINT):
        signal.signal(signum, lambda *_: stop.set())
    store = Store(settings.database_url)
    with cluster(settings) as capacity:
        logging.getLogger("gaplab.supervisor").info("ready for %d repetitions at once", capacity)
        Supervisor(store, capacity).serve(stop)
    store.dispose()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
