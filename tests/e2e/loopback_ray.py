"""`ray`, which takes loopback for this machine's address: nobody else reaches a cluster that it starts.

Ray replaces 127.0.0.1 by an address that other machines reach, and listens on all of them. The setting that stops it,
RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER=0, forbids a second node as well; a driver can have it.
"""

from ray._private import services
from ray.scripts.scripts import main

if __name__ == "__main__":
    services.get_node_ip_address = lambda address=None: "127.0.0.1"
    main()
